"""The parts of make_dancer.py: shape, skeleton, dance, and file of the dancer of examples/dance_stage."""
