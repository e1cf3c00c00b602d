"""The model file of a plan, as text; written by hand so that it shares nothing with the reader."""

from collections.abc import Iterable

from chladni.gap.blind.plan import GROUND, Input, Output, Plan


def model_text(plan: Plan) -> str:
    """Give ``model.toml`` with the nominal numbers."""
    return "\n\n".join(_drive_tables(plan) if plan.drive else _structure_tables(plan)) + "\n"


def _structure_tables(plan: Plan) -> list[str]:
    return [
        f'format = "chladni.model/1"\nname = "{plan.name}"\nkind = "structure"',
        *(_table("body", {"name": body, plan.inertia_of(body).split(".")[1]: plan.numbers[plan.inertia_of(body)]})
          for body in plan.bodies),
        *(_table("joint", {
            "name": joint.name, "between": [joint.first, joint.second],
            "stiffness": plan.numbers[f"{joint.name}.stiffness"], "damping": plan.numbers[f"{joint.name}.damping"],
        }) for joint in plan.joints),
        *(_input(one) for one in plan.inputs),
        *(_output(one) for one in plan.outputs),
        *_controllers(plan),
        _tolerances(plan),
    ]  # fmt: skip


def _drive_tables(plan: Plan) -> list[str]:
    options = [f'{name} = "{word}"' for name, word in plan.options.items()]
    return [
        f'format = "chladni.model/1"\nname = "{plan.name}"\nkind = "drive"\ndrive = "{plan.drive}"',
        *(["\n".join(["[options]", *options])] if options else []),
        "\n".join(["[parameters]", *(f"{name} = {value!r}" for name, value in plan.numbers.items())]),
        *(_table("input", {"signal": one.name, "channel": one.channel}) for one in plan.inputs),
        *(_table("output", {"signal": one.measures, "channel": one.channel}) for one in plan.outputs),
        "\n".join(["[tolerance]", *(f"{name} = {value!r}" for name, value in plan.tolerance.items())]),
    ]


def _table(name: str, content: dict[str, object]) -> str:
    return "\n".join([f"[[{name}]]", *(f"{key} = {_value(value)}" for key, value in content.items())])


def _value(value: object) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, list):
        return f"[{', '.join(_value(one) for one in value)}]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_value(one)}" for key, one in value.items()) + " }"
    return repr(value)


def _place(one: Input | Output) -> dict[str, object]:
    return {"joint": one.joint} if one.joint else {"at": one.at}


def _input(one: Input) -> str:
    kind = "base_acceleration" if one.at == GROUND else "force"
    return _table("input", {"name": one.name, "kind": kind, **_place(one), "channel": one.channel})


def _output(one: Output) -> str:
    return _table("output", {"name": one.name, "measures": one.measures, **_place(one), "channel": one.channel})


def _controllers(plan: Plan) -> Iterable[str]:
    if plan.loop is None:
        return
    loop = plan.loop
    gains = {name.split(".")[1]: value for name, value in plan.numbers.items() if name.startswith(f"{loop.name}.")}
    gain = gains.pop("gain")
    content: dict[str, object] = {
        "name": loop.name, "reference": loop.reference, "feedback": loop.feedback, "law": loop.law, "gains": gains,
        "drives": loop.drives, "gain": f"{gain!r} N m/V" if plan.rotary else f"{gain!r} N/V",
    }  # fmt: skip
    if loop.limit is not None:
        content["limit"] = f"{loop.limit!r} N m" if plan.rotary else f"{loop.limit!r} N"
    yield _table("controller", content)


def _tolerances(plan: Plan) -> str:
    return "\n".join(["[tolerance]", "default = 0.05", *(f'"{name}" = {value!r}' for name, value in
                                                          plan.tolerance.items())])  # fmt: skip
