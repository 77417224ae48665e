"""What positions the crane alone: its rigid inverses, adaptation, methods from parameters."""
