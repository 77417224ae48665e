"""Errors of the direct kinematics of the SmartEE."""
