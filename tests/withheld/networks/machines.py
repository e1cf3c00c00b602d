"""Small machines whose motion other programs know."""

from chladni_withheld.networks.excitation import Grid, Signal
from chladni_withheld.networks.network import GROUND, Drive, Joint, Network, Sensor


def two_bodies(**changes):
    """A frame on the ground and a head on the frame, both also held to the ground: a loop through it."""
    made = {
        "rotary": False,
        "bodies": ("frame", "head"),
        "masses": (3.0, 1.2),
        "joints": (
            Joint(name="mount", first=GROUND, second=0, stiffness=9e4, damping=14.0),
            Joint(name="bush", first=0, second=1, stiffness=5e4, damping=6.0),
            Joint(name="strut", first=GROUND, second=1, stiffness=2e4, damping=3.0),
        ),
        "drives": (Drive(name="shaker", where="body", at=0),),
        "sensors": (
            Sensor(name="acc_frame", measures="acceleration", where="body", at=0),
            Sensor(name="pos_head", measures="displacement", where="body", at=1),
            Sensor(name="vel_bush", measures="velocity", where="joint", at=1),
            Sensor(name="load_bush", measures="force", where="joint", at=1),
        ),
    }
    return Network(**(made | changes))


def grid(samples=800, before=400, over=16, rate_hz=500.0):
    return Grid(rate_hz=rate_hz, samples=samples, before=before, over=over)


def signal_of(function, over_grid):
    """A smooth signal, of a function of the time."""
    return Signal(values=function(over_grid.half_times_s()))
