"""The log crane of Rouvinen (1999)."""
