"""Universal files of impact tests, written by another program, from structures in closed form."""

import pyuff


def write_functions(path, functions, frequency_hz, *, responses, references):
    """Write accelerances ``functions[response, reference, line]`` between nodes along +z, as dataset 58 in text."""
    sets = [
        _function(functions[row, column], frequency_hz, node, hit)
        for row, node in enumerate(responses)
        for column, hit in enumerate(references)
    ]
    pyuff.UFF(str(path)).write_sets(sets, mode="overwrite")
    return path


def _function(values, frequency_hz, node, hit):
    header = pyuff.prepare_58(
        binary=0, func_type=4, rsp_node=node, rsp_dir=3, ref_node=hit, ref_dir=3, data=values, x=frequency_hz,
        id1="NONE", rsp_ent_name="NONE", ref_ent_name="NONE", abscissa_spacing=1, abscissa_spec_data_type=18,
        ordinate_spec_data_type=12, orddenom_spec_data_type=13, ordinate_axis_units_lab="m/s^2",
        orddenom_axis_units_lab="N", return_full_dict=True,
    )  # fmt: skip
    header["ordinate_axis_lab"] = header["orddenom_axis_lab"] = header["abscissa_axis_lab"] = "NONE"
    return {key: value for key, value in header.items() if value is not None}
