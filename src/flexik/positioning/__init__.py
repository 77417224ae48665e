"""Methods from target and payload to actuator coordinates, one file a method."""
