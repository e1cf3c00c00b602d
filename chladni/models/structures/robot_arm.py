"""A robot arm as a chain of five bodies: the project's own example structure."""

from chladni.models.structures.structure import Body, Joint, Structure


def robot_arm() -> Structure:
    """Base, column, arm, wrist and tool, with modes between 24 and 170 Hz and damping ratios of 1 to 3 %."""
    return Structure(
        bodies=(
            Body(name="base", mass=40.0, position=(0.0, 0.0, 0.0)),
            Body(name="column", mass=12.0, position=(0.0, 0.0, 0.45)),
            Body(name="arm", mass=6.0, position=(0.28, 0.0, 0.80)),
            Body(name="wrist", mass=2.5, position=(0.62, 0.0, 0.85)),
            Body(name="tool", mass=1.2, position=(0.78, 0.0, 0.72)),
        ),
        joints=(
            Joint(name="foot", between=("ground", "base"), stiffness=9.0e6, damping=900.0),
            Joint(name="turret", between=("base", "column"), stiffness=2.4e6, damping=250.0),
            Joint(name="shoulder", between=("column", "arm"), stiffness=4.5e5, damping=70.0),
            Joint(name="elbow", between=("arm", "wrist"), stiffness=1.6e5, damping=22.0),
            Joint(name="flange", between=("wrist", "tool"), stiffness=9.0e5, damping=18.0),
        ),
    )
