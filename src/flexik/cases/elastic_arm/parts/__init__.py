"""What is computed of the elastic arm, stage by stage."""
