"""What the case computes, a module a stage."""
