"""What the cases of planar flexible machines share: their section, columns and parts."""
