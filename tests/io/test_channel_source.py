"""Where a channel's unit comes from."""

from chladni.io.channel_source import comment_units

# The layout of sensor_msgs/NavSatFix: each comment stands above the field it speaks of.
ABOVE = """# Latitude [degrees].
float64 latitude

# Longitude [degrees].
float64 longitude

# Altitude [m].
float64 altitude

# Position covariance [m^2]
float64[9] position_covariance
"""


def test_a_comment_on_the_next_line_is_not_the_field_s() -> None:
    assert comment_units(ABOVE) == {}


def test_a_comment_behind_a_field_may_follow_a_constant_and_end_in_a_carriage_return() -> None:
    assert comment_units("float64 x  # along the beam [mm]\r\nfloat64 G=9.8 # [m/s^2]\r\n") == {
        "x": "mm",
        "G": "m/s^2",
    }
