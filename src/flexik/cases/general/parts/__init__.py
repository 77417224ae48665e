"""Parts of the stages, those that all planar machines share."""
