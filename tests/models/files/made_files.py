"""A model file with everything in it, for the tests of this room."""

from pathlib import Path

STRUCTURE = """\
format = "chladni.model/1"
name = "arm"
kind = "structure"

[[body]]
name = "column"
mass = "12 kg"
position = [0.0, 0.0, "400 mm"]

[[body]]
name = "wrist"
mass = 2.5

[[joint]]
name = "shoulder"
between = ["ground", "column"]
stiffness = 1.2e6
damping = 200.0

[[joint]]
name = "elbow"
between = ["column", "wrist"]
stiffness = "0.6 kN/mm"
damping = 90

[[input]]
name = "hammer"
at = "wrist"
channel = "/hammer.wrench.force.x"

[[input]]
name = "motor"
joint = "elbow"

[[input]]
name = "floor"
kind = "base_acceleration"

[[input]]
name = "noise"
kind = "disturbance"
at = "axis"

[[output]]
name = "acc_wrist"
measures = "acceleration"
at = "wrist"
channel = "/wrist.accel.linear.x"

[[output]]
name = "bend"
measures = "displacement"
joint = "elbow"

[[output]]
name = "pull"
measures = "force"
joint = "elbow"

[[controller]]
name = "axis"
reference = "/command.position[0]"
feedback = "bend"
law = "pd"
gains = { kp = "20 V/mm", kd = 3.0 }
drives = "motor"
gain = "35.15 N/V"
limit = "10 V"

[[effect]]
effect = "coulomb_friction"
site = "elbow"
parameters = { force = 8.1 }

[[effect]]
effect = "cross_axis"
site = "acc_wrist"
variant = "share"
parameters = { coefficient = "2 %", from = "bend" }

[tolerance]
default = 0.1
"elbow.stiffness" = 0.2
"""

DRIVE = """\
format = "chladni.model/1"
name = "motor"
kind = "drive"
drive = "pneumatic-motor"

[options]
end_stops = "on"

[parameters]
active_area = "60 cm^2"

[[input]]
signal = "flow"
channel = "/flow"

[[output]]
signal = "velocity"
name = "v"

[[effect]]
effect = "clipping"
site = "v"
parameters = { limit = "50 cm/s" }

[tolerance]
default = 0.1
active_area = 0.02
"""

SCHEME = """\
format = "chladni.model/1"
name = "loop"
kind = "scheme"

[[input]]
name = "reference"

[[block]]
name = "regulator"
kind = "pi"
parameters = { gain = 2.97, integral_time = "9900 ms" }
input = ["+reference", "-plant"]

[[block]]
name = "plant"
num = [1.0]
den = [0.7, 1.0]
input = ["regulator"]

[[output]]
name = "speed"
at = "plant"

[[effect]]
effect = "clipping"
site = "speed"
parameters = { limit = 5.0 }

[tolerance]
"regulator.gain" = 0.2
"""


def written(folder: Path, text: str) -> Path:
    """Write a file and give its path."""
    path = folder / "m.toml"
    path.write_text(text)
    return path
