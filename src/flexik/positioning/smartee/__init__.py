"""Direct kinematics of the SmartEE: network, Newton, and both together."""
