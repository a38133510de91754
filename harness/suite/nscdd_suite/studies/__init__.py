"""All studies. A new one is a file here and a line below."""
import functools


@functools.cache
def studies():
    """{name: study}, in the order of the page."""
    from . import acceleration, accuracy, bits, gallery, hard, million, paper, partitions, peers, physics, reduced, rheology, scaling, velocity_error, wild

    classes = (
        paper.Paper,
        physics.Physics,
        rheology.Rheology,
        gallery.Gallery,
        peers.Peers,
        reduced.Reduced,
        bits.Bits,
        hard.Hard,
        accuracy.Accuracy,
        acceleration.Acceleration,
    )
    classes += (velocity_error.VelocityError, wild.Wild, partitions.Partitions, scaling.Scaling, million.Million)
    return {one.name: one() for one in classes}
