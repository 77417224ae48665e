"""Six-joint arm after the FANUC M-710i (Hasan 2005)."""
