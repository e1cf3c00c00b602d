"""Where a damper helps a robot arm most, and what its stiffness does: influence, best values, the best joint."""

import chladni
from chladni import INSTRUMENTS, Damper, place_damper


def main() -> None:
    """Print the arm's influence coefficients, the best joint for a damper, and the stiffness that raises the mode."""
    arm = INSTRUMENTS["robot-arm"].model()
    table = chladni.influence(
        arm, to_output="tool_displacement", behaviour_names=("damping_ratio", "resonance_frequency")
    )
    print("d ln / d ln                damping ratio       resonance")
    for name, row in zip(table.construction, table.log_derivative, strict=True):
        print(f"{name:24}{row[0]:16.3f}{row[1]:16.3f}")

    wish = chladni.Wish(quantity="damping_ratio", sense="at_least", limit=0.05)
    placement = place_damper(arm, wish, [Damper(name="viscous", low=0.0, high=5000.0)], to_output="tool_displacement")
    print("\nsmallest damper that gives the first mode 5 % of damping")
    for tried in placement.tried:
        told = f"{tried.coefficient:8.0f} N s/m" if tried.met else "can't"
        print(f"  at {tried.joint:10} {told}")

    wish = chladni.Wish(quantity="resonance_frequency", sense="greatest")
    bounds = {"shoulder.stiffness": (3e5, 9e5), "elbow.stiffness": (1e5, 3e5)}
    best = chladni.optimise(arm, list(bounds), wish, bounds=bounds)
    print(f"\n{best.wishes[0]}: from {best.wished_before[0].value:.2f} to {best.wished_after[0].value:.2f} Hz")
    for sentence in best.advice:
        print(" ", sentence)


if __name__ == "__main__":
    main()
