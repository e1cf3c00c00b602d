"""Unit labels as standards, instruments and exporters write them: read right, refused, or wrong by the letter.

Run with ``.venv/bin/python benchmarks/unit_labels.py``. The truth is by definition (SI brochure 2019; international
yard and pound 1959; CGPM 1901), not by the project's own list of units.
"""

from collections import Counter
from dataclasses import dataclass
from math import isclose, pi

from chladni.signals.errors import SetupError
from chladni.signals.unit_labels import read_label, same_quantity

G = 9.80665
INCH, FOOT = 0.0254, 0.3048
POUND = 0.45359237
POUND_FORCE = POUND * G
OUNCE_FORCE = POUND_FORCE / 16
DEGREE = pi / 180
TURN = 2 * pi
PSI = POUND_FORCE / INCH**2
# Two roundings of a factor that definitions give exactly.
ROUNDING = 1e-12


@dataclass(frozen=True, slots=True)
class UnitLabel:
    """A label with what is right of it.

    Attributes
    ----------
    text
        The label.
    quantity
        SI unit of what the file says beside it that the values are, or None.
    factor, unit
        To SI; `unit` is None where the label leaves the unit open, which only a refusal does justice to.
    source
        Who writes it so.
    """

    text: str
    quantity: str | None
    factor: float
    unit: str | None
    source: str


def _same(texts: str, factor: float, unit: str | None, source: str, quantity: str | None = None) -> list[UnitLabel]:
    return [UnitLabel(text, quantity, factor, unit, source) for text in texts.split(" | ")]


LABELS: tuple[UnitLabel, ...] = (
    # Acceleration
    *_same("m/s² | m·s⁻² | m s⁻²", 1.0, "m/s^2", "SI brochure, 5.4"),
    *_same("m/s^2", 1.0, "m/s^2", "ROS REP 103; UFF 58 of Siemens Testlab; MATLAB"),
    *_same("m/s2", 1.0, "m/s^2", "UCUM; UFF 58 of analysers; Xsens exports"),
    *_same("m/s**2", 1.0, "m/s^2", "SEED 2.4, blockette 34, in small letters; SymPy, Python"),
    *_same("M/S**2 | M/S/S", 1.0, "m/s^2", "SEED 2.4, blockette 34"),
    *_same("m/s/s", 1.0, "m/s^2", "ArduPilot LogStructure.h; PX4 message definitions"),
    *_same("m s-2", 1.0, "m/s^2", "UDUNITS, CF conventions of netCDF"),
    *_same("ms-2 | ms^-2 | ms⁻²", 1.0, "m/s^2", "Brüel & Kjær data sheets (pC/ms⁻²), British exports"),
    *_same("m.s-2 | m.s^-2 | m*s^-2", 1.0, "m/s^2", "ISO 80000-1 with a dot on the line; French exports"),
    *_same("m/sec2 | m/sec^2 | m/sec²", 1.0, "m/s^2", "VibrationVIEW and DasyLab exports; calibration sheets"),
    *_same("meter/sec**2", 1.0, "m/s^2", "MSC Adams result files, unitsValue"),
    *_same("meters per second squared", 1.0, "m/s^2", "NI-DAQmx, DAQmx_Val_MetersPerSecondSquared in words"),
    *_same("m/s^{2}", 1.0, "m/s^2", "axis labels in TeX, MATLAB and matplotlib"),
    *_same("mm/s² | mm/s2 | mm/s^2", 1e-3, "m/s^2", "machine condition monitoring"),
    *_same("MILLIMETER/SECOND^2", 1e-3, "m/s^2", "MTConnect, NativeUnits"),
    *_same("cm/s2 | cm/s/s", 1e-2, "m/s^2", "COSMOS, K-NET strong motion records"),
    *_same("Gal", 1e-2, "m/s^2", "ISO 80000-3, gravimetry"),
    *_same("gal", 1e-2, "m/s^2", "K-NET headers: an acceleration in gal", "m/s^2"),
    *_same("in/s² | in/s^2", INCH, "m/s^2", "NI-DAQmx, DAQmx_Val_InchesPerSecondSquared; UFF of I-deas IN"),
    *_same("ft/s^2 | ft/sec^2", FOOT, "m/s^2", "I-deas BG; MIL-STD-810 reports"),
    *_same("g", G, "m/s^2", "NI-DAQmx, DAQmx_Val_AccelUnit_g; IEEE 1451.4 template 25; PCB"),
    *_same("mg", 1e-3 * G, "m/s^2", "MEMS data sheets (Analog Devices, ST)"),
    *_same("µg | ug", 1e-6 * G, "m/s^2", "MEMS data sheets; seismic accelerometers (PCB 393)"),
    *_same("gn", G, "m/s^2", "ISO 2041; Endevco and Meggitt sheets"),
    *_same("g0", G, "m/s^2", "unit converters; NIST SP 811, g with index 0"),
    *_same("g's | G's | Gs", G, "m/s^2", "Dytran and Endevco sheets"),
    *_same("g rms | gRMS | Grms | g pk | g (peak)", G, "m/s^2", "calibration certificates; random vibration tests"),
    *_same("[g]", G, "m/s^2", "UCUM, the acceleration of free fall"),
    *_same("G", G, "m/s^2", "MoTeC, VibrationVIEW: an acceleration in G", "m/s^2"),
    *_same("G | mG", 0.0, None, "gravity of an accelerometer, gauss of a magnetometer; nothing beside it"),
    # Velocity, displacement
    *_same("m/s | m s-1 | m s^-1 | ms^-1 | ms-1 | M/S", 1.0, "m/s", "SI brochure; UDUNITS; SEED"),
    *_same("mm/s | mm/sec | mm/s RMS", 1e-3, "m/s", "ISO 20816 and its instruments"),
    *_same("µm/s | um/s", 1e-6, "m/s", "Polytec vibrometers"),
    *_same("nm/s", 1e-9, "m/s", "seismometers, SAC files"),
    *_same("in/s | in/sec | ips | IPS | IPS pk | in./s", INCH, "m/s", "API 670; Bently Nevada, CSI"),
    *_same("ft/s | fps", FOOT, "m/s", "I-deas BG; ballistics"),
    *_same("km/h | kph", 1 / 3.6, "m/s", "vehicle loggers (MoTeC, VBOX), CAN databases"),
    *_same("mph", 1609.344 / 3600, "m/s", "vehicle loggers"),
    *_same("mm", 1e-3, "m", "ISO 80000-3"),
    *_same("µm | um | micron | microns", 1e-6, "m", "proximity probes, laser sensors"),
    *_same("mil | mils | mils pk-pk | thou", INCH * 1e-3, "m", "API 670; Bently Nevada"),
    *_same("in | inch | inches | in.", INCH, "m", "NI-DAQmx, DAQmx_Val_Inches; LVDT sheets"),
    # Force, mass, torque
    *_same("N | Newton | Newtons | newtons", 1.0, "N", "NI-DAQmx, DAQmx_Val_Newtons; IEEE 1451.4"),
    *_same("kN | KN", 1e3, "N", "load cells; labels in capitals"),
    *_same("lbf", POUND_FORCE, "N", "NIST SP 811; PCB impact hammers"),
    *_same("lb | lbs | pounds | LB", POUND_FORCE, "N", "IEEE 1451.4 force template; NI-DAQmx pounds", "N"),
    *_same("lb | lbs", 0.0, None, "a load cell's pound or a scale's; nothing beside it"),
    *_same("kgf | kp", G, "N", "NI-DAQmx, DAQmx_Val_KilogramForce; DIN 1301-3"),
    *_same("kg", G, "N", "Japanese and Indian load cells: a force in kg", "N"),
    *_same("kg | Kg | KG", 1.0, "kg", "SI brochure; scales"),
    *_same("kg m/s^2", 1.0, "N", "SI brochure, table 4: a force in base units", "N"),
    *_same("N m | N·m | N*m | Nm | N-m | N.m", 1.0, "N m", "SI brochure; HBK T40; Kistler; DIAdem"),
    *_same("ft-lb | ft·lb | lb-ft | lbf-ft | ft*lbf", FOOT * POUND_FORCE, "N m", "NI-DAQmx foot-pounds; Simscape"),
    *_same("in-lb | lb-in | inch-pounds", INCH * POUND_FORCE, "N m", "NI-DAQmx, DAQmx_Val_InchPounds"),
    *_same("oz-in | in-oz", INCH * OUNCE_FORCE, "N m", "NI-DAQmx, DAQmx_Val_InchOunces; small motors"),
    *_same("kgf·cm | kg-cm", G * 1e-2, "N m", "servo data sheets"),
    *_same("N s | Ns | N·s", 1.0, "N s", "impulse of hammers"),
    # Pressure
    *_same("Pa | pascal", 1.0, "Pa", "IEC 61672; UFF 58 ordinate type 15"),
    *_same("PA", 1.0, "Pa", "SEED 2.4: a pressure in PA", "Pa"),
    *_same("kPa | KPA | kpa", 1e3, "Pa", "vehicle loggers"),
    *_same("psi | PSI | psig", PSI, "Pa", "IEEE 1451.4; NI-DAQmx; PCB"),
    *_same("lb/in² | lb/in^2", PSI, "Pa", "engineering drawings; old analysers"),
    *_same("bar | Bar | BAR", 1e5, "Pa", "NI-DAQmx, DAQmx_Val_Bar; Kistler"),
    *_same("mbar", 1e2, "Pa", "barometers"),
    *_same("kg/cm²", G * 1e4, "Pa", "hydraulics in Asia: kgf/cm²"),
    *_same("N/mm² | N/mm^2", 1e6, "Pa", "materials testing, ISO 6892"),
    # Turning
    *_same("rpm | RPM | Rpm | rev/min | r/min | U/min", TURN / 60, "rad/s", "ISO 80000-3; DIN; tachometers"),
    *_same("1/min | min-1 | min⁻¹ | min^-1", 1 / 60, "1/s", "ASAM MDF of vehicle tests, DIN 1301"),
    *_same("rev/s | rps", TURN, "rad/s", "tachometers"),
    *_same("CPM | cpm", 1 / 60, "Hz", "condition monitoring: cycles per minute"),
    *_same("deg | ° | degrees | Deg", DEGREE, "rad", "ROS REP 103; NI-DAQmx; Xsens exports"),
    *_same("deg/s | °/s | deg/sec | dps | º/s", DEGREE, "rad/s", "gyroscopes (ST, Bosch, LP-Research)"),
    *_same("rad/s | rad s-1 | rad s^-1", 1.0, "rad/s", "ROS REP 103; CF conventions; PX4"),
    *_same("rad/s/s | rad/s²", 1.0, "rad/s^2", "ArduPilot LogStructure.h; SI brochure"),
    # Electricity, magnetism, temperature, ratios
    *_same("V | Volt | Volts | volts | VOLTS | Vrms", 1.0, "V", "NI-DAQmx; UFF 58 of PULSE; LabVIEW .lvm"),
    *_same("mV", 1e-3, "V", "oscilloscopes"),
    *_same("A | Amps | amps | Amperes", 1.0, "A", "NI-DAQmx, DAQmx_Val_Amps; drives"),
    *_same("Ohm | Ohms | ohm | Ω", 1.0, "ohm", "NI-DAQmx, DAQmx_Val_Ohms; ArduPilot"),
    *_same("pC", 1e-12, "C", "charge amplifiers (Kistler, Brüel & Kjær)"),
    *_same("A.s | A s", 1.0, "A s", "ArduPilot LogStructure.h"),
    *_same("uT | µT", 1e-6, "T", "magnetometers (LP-Research, Android)"),
    *_same("Gauss | gauss | Ga", 1e-4, "T", "ArduPilot; PX4 VehicleMagnetometer"),
    *_same("G", 1e-4, "T", "magnetometer sheets (Honeywell): a field in G", "T"),
    *_same("°C | degC | deg C | Deg C | ºC | ° C", 1.0, "degC", "NI-DAQmx; Excel exports; UDUNITS"),
    *_same("C", 1.0, "degC", "vehicle loggers: a temperature in C", "degC"),
    *_same("K", 1.0, "K", "SI brochure"),
    *_same("°F | degF | deg F", 0.0, None, "an offset is no factor"),
    *_same("% | percent", 1e-2, "1", "SI brochure, 5.4.7"),
    *_same("µm/m | um/m | µε | ue | microstrain", 1e-6, "1", "HBK catman; NI-DAQmx strain; VDI 2635"),
    *_same("mV/V", 1e-3, "1", "strain gauge bridges (HBK)"),
    *_same("counts | COUNTS | LSB | count", 1.0, "1", "SEED 2.4; converters"),
    *_same("- | NONE | n/a | unitless", 1.0, "1", "UFF 58 general note 1; CANape, Excel exports"),
    *_same("EU", 0.0, None, "Siemens Testlab, DaqBook: engineering units, whatever was set up"),
    *_same("a.u.", 0.0, None, "arbitrary units (Xsens magnetometers)"),
    *_same("dB | dB(A) | dB re 1 g", 0.0, None, "a logarithm, no multiple of a unit"),
    # Sensitivities, functions, densities
    *_same("mV/g", 1e-3 / G, "V/(m/s^2)", "IEEE 1451.4 template 25; PCB, Dytran"),
    *_same("mV/(m/s²) | mV/ms^-2 | mV/ms⁻²", 1e-3, "V/(m/s^2)", "PCB and Brüel & Kjær sheets"),
    *_same("pC/ms^-2 | pC/ms⁻²", 1e-12, "C/(m/s^2)", "Brüel & Kjær 4370 and its kin"),
    *_same("pC/g", 1e-12 / G, "C/(m/s^2)", "Endevco, Dytran"),
    *_same("mV/N", 1e-3, "V/N", "PCB 086C03"),
    *_same("mV/lbf", 1e-3 / POUND_FORCE, "V/N", "PCB 086C03"),
    *_same("mV/lb", 1e-3 / POUND_FORCE, "V/N", "PCB 208: a force sensor's sensitivity", "V/N"),
    *_same("(m/s^2)/N | m/s²/N | (m/s²)/N | m/s^2/N", 1.0, "(m/s^2)/N", "ISO 7626-1; UFF 58 of Testlab and PULSE"),
    *_same("g/N", G, "(m/s^2)/N", "UFF 58 of Testlab"),
    *_same("g/lbf", G / POUND_FORCE, "(m/s^2)/N", "ME'scope"),
    *_same("g/lb", G / POUND_FORCE, "(m/s^2)/N", "ME'scope: acceleration over force", "(m/s^2)/N"),
    *_same("(m/s)/N | m/s/N", 1.0, "(m/s)/N", "ISO 7626-1, mobility"),
    *_same("in/lbf", INCH / POUND_FORCE, "m/N", "ISO 7626-1, receptance, in inches"),
    *_same("g²/Hz | g^2/Hz", G**2, "(m/s^2)^2/Hz", "IEC 60068-2-64; VibControl's UFF 58"),
    *_same("(m/s²)²/Hz | (m/s^2)^2/Hz", 1.0, "(m/s^2)^2/Hz", "IEC 60068-2-64"),
    # Slips that the quantity confirms, and only that
    *_same("m/s^-2 | ms2", 1.0, "m/s^2", "slips in exports, beside an acceleration", "m/s^2"),
    *_same("m/s^-2 | ms^2", 0.0, None, "slips, with nothing beside them"),
    # Time and frequency
    *_same("s | sec | Sec | seconds | SEC", 1.0, "s", "UFF 58 abscissa; LabVIEW .lvm; SEED"),
    *_same("ms | msec", 1e-3, "s", "UFF 58 abscissa; oscilloscopes"),
    *_same("µs | us | usec", 1e-6, "s", "PX4 timestamps; oscilloscopes"),
    *_same("Hz | HZ | hz | Hertz | cps", 1.0, "Hz", "UFF 58 abscissa; SEED; old analysers"),
    *_same("kHz | KHz | Khz", 1e3, "Hz", "UFF 58 abscissa; acoustics"),
)


def verdict(label: UnitLabel) -> str:
    """``right``, ``refused`` or ``wrong``; refusing what leaves its unit open is right."""
    try:
        factor, unit = read_label(label.text, quantity=label.quantity)
    except SetupError:
        return "refused" if label.unit is not None else "right"
    if label.unit is None or not same_quantity(unit, label.unit):
        return "wrong"
    return "right" if isclose(factor, label.factor, rel_tol=ROUNDING) else "wrong"


def main() -> None:
    found = {label: verdict(label) for label in LABELS}
    for label, word in found.items():
        if word != "right":
            print(f"{word}: {label.text!r} as {label.quantity or 'anything'} ({label.source})")
    counts = Counter(found.values())
    print("| labels | right | refused | wrong |\n| ---: | ---: | ---: | ---: |")
    print(f"| {len(LABELS)} | {counts['right']} | {counts['refused']} | {counts['wrong']} |")


if __name__ == "__main__":
    main()
