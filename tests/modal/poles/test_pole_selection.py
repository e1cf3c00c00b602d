import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.modal.poles.pole_clusters import PAIRS_TOGETHER, ClusterTolerance, cluster_poles
from chladni.modal.poles.pole_selection import SelectionRules, select_poles
from chladni.signals.errors import SetupError
from tests.modal.pole_tables import empty_table, made_table, table_of

ONE, OTHER, BETWEEN = (1.0, 0.0), (0.0, 1.0), (0.8, 0.6)
THREE = ((10.0, 0.01, ONE), (25.0, 0.02, OTHER), (40.0, 0.005, BETWEEN))


def test_modes_are_found_among_strays():
    chosen = select_poles(made_table(THREE, strays=40))
    # Thirty orders with a scatter of 2e-4: the mean is known to 4e-5, the middle pole to 2e-4.
    np.testing.assert_allclose(chosen.spread.frequency_hz, [10, 25, 40], rtol=3e-4)
    np.testing.assert_allclose(np.abs(chosen.pole) / (2 * np.pi), [10, 25, 40], rtol=1e-3)
    np.testing.assert_allclose(chosen.spread.frequency_std_hz / [10, 25, 40], 2e-4, rtol=0.6)
    np.testing.assert_allclose(chosen.spread.damping_ratio, [0.01, 0.02, 0.005], rtol=0.03)
    np.testing.assert_allclose(chosen.spread.damping_std / [0.01, 0.02, 0.005], 2e-2, rtol=0.6)
    assert chosen.spread.orders.tolist() == [30, 30, 30]
    assert chosen.notes == ()


def test_members_and_representatives_are_rows_of_the_table():
    table = made_table(THREE, strays=5)
    chosen = select_poles(table)
    np.testing.assert_array_equal(chosen.pole, table.pole[chosen.row])
    np.testing.assert_array_equal(chosen.vector, table.vector[chosen.row])
    np.testing.assert_array_equal(chosen.member[chosen.row], [0, 1, 2])
    for mode in range(3):
        mine = chosen.member == mode
        assert mine.sum() == chosen.spread.orders[mode]
        assert np.unique(table.order[mine]).size == mine.sum()
        assert table.frequency_hz[mine].mean() == pytest.approx(chosen.spread.frequency_hz[mode])


def test_close_modes_with_one_and_the_same_vector_stay_apart():
    # 0.2 % apart, with a scatter of a tenth of that: only their standing side by side at each order tells them apart.
    table = made_table(((10.0, 0.01, ONE), (10.02, 0.01, ONE)))
    chosen = select_poles(table)
    np.testing.assert_allclose(chosen.spread.frequency_hz, [10.0, 10.02], atol=0.003)
    assert chosen.spread.orders.tolist() == [30, 30]


def test_close_modes_that_scatter_more_than_they_differ_are_kept_by_their_vectors():
    table = made_table(((10.0, 0.01, ONE), (10.02, 0.01, OTHER)), scatter=(3e-3, 0.05))
    chosen = select_poles(table)
    assert chosen.spread.orders.tolist() == [30, 30]
    assert sorted(np.abs(chosen.vector[:, 0]).round(6).tolist()) == [0.0, 1.0]


def test_a_pole_that_orders_hold_twice_is_one_mode():
    table = made_table(((10.0, 0.01, ONE), (10.0, 0.01, ONE)), scatter=(1e-3, 0.05))
    assert select_poles(table).pole.size == 1


def test_strays_alone_are_no_modes():
    assert select_poles(made_table((), strays=30)).pole.size == 0


def test_an_empty_table_has_no_modes():
    chosen = select_poles(empty_table(), count=2)
    assert chosen.pole.size == 0
    assert chosen.vector.shape == (0, 2)
    assert "2 modes asked for" in chosen.notes[0]
    assert "no pole within" in select_poles(empty_table(), frequencies_hz=[3.0]).notes[0]


def test_a_mode_needs_its_share_of_the_orders():
    few = [(order, 10.0, 0.01, ONE) for order in range(2, 8)]
    table = table_of(few, range(2, 32))
    assert select_poles(table).pole.size == 0
    assert select_poles(table, rules=SelectionRules(share=0.2)).pole.size == 1


def test_a_mode_that_is_missing_at_some_orders_is_one_mode():
    rows = [(order, 10.0, 0.01, ONE) for order in range(2, 32) if order % 5]
    assert select_poles(table_of(rows, range(2, 32))).spread.orders.tolist() == [24]


@pytest.mark.parametrize(
    ("band_hz", "expected"), [((20.0, 50.0), [25, 40]), ((1.0, 30.0), [10, 25]), ((11.0, 12.0), [])]
)
def test_band(band_hz, expected):
    chosen = select_poles(made_table(THREE, strays=3), band_hz=band_hz)
    np.testing.assert_allclose(chosen.spread.frequency_hz, expected, rtol=1e-3)


def test_damping_range():
    table = made_table(((10.0, 0.3, ONE), (20.0, 1e-6, ONE), (30.0, 0.01, ONE)))
    np.testing.assert_allclose(select_poles(table).spread.frequency_hz, [30], rtol=1e-3)


def test_fewer_than_there_are_takes_those_that_most_orders_hold():
    rows = [(order, 10.0, 0.01, ONE) for order in range(2, 32)] + [
        (order, 20.0, 0.01, ONE) for order in range(12, 32)
    ]
    table = table_of(sorted(rows), range(2, 32))
    chosen = select_poles(table, count=1)
    np.testing.assert_allclose(chosen.spread.frequency_hz, [10.0])
    assert chosen.notes == ()


def test_more_than_there_are_gives_those_there_are_with_a_reason():
    chosen = select_poles(made_table(THREE), count=5)
    assert chosen.pole.size == 3
    assert chosen.notes == ("5 modes asked for, but the poles of no more than 3 agree over the model orders",)


def test_frequencies_asked_for():
    chosen = select_poles(made_table(THREE, strays=3), frequencies_hz=[40.1, 9.95])
    np.testing.assert_allclose(chosen.spread.frequency_hz, [10, 40], rtol=1e-3)
    assert chosen.notes == ()


def test_a_frequency_asked_for_is_taken_from_few_orders_too():
    rows = [(order, 10.0, 0.01, ONE) for order in range(5, 8)]
    chosen = select_poles(table_of(rows, range(2, 32)), frequencies_hz=[10.0])
    assert chosen.spread.orders.tolist() == [3]


def test_a_frequency_without_a_pole_is_told_and_not_invented():
    chosen = select_poles(made_table(THREE), frequencies_hz=[10.0, 17.0])
    np.testing.assert_allclose(chosen.spread.frequency_hz, [10], rtol=1e-3)
    assert chosen.notes == ("no pole within 2% of 17 Hz that another frequency hasn't taken: no mode there",)


def test_two_frequencies_never_get_the_same_pole():
    chosen = select_poles(made_table(THREE), frequencies_hz=[10.0, 10.05, 10.0])
    assert chosen.pole.size == 1
    assert "10.05 Hz" in chosen.notes[0]
    both = select_poles(made_table(((10.0, 0.01, ONE), (10.1, 0.01, OTHER))), frequencies_hz=[10.04, 10.06])
    np.testing.assert_allclose(both.spread.frequency_hz, [10.0, 10.1], rtol=3e-4)


def test_poles_that_their_own_sigma_rejects_are_left_out():
    plain = made_table(THREE)
    size = plain.order.size
    sure, unsure = np.full(size, 1e-4), np.where(plain.frequency_hz > 20, 5.0, 1e-3)
    table = made_table(THREE, frequency_std_hz=unsure, damping_std=sure)
    np.testing.assert_allclose(select_poles(table).spread.frequency_hz, [10], rtol=1e-3)


def test_sigmas_join_what_scatters_more_than_the_tolerance():
    size = 30
    tight = SelectionRules(tolerance=ClusterTolerance(frequency=1e-4, damping=1e-2))
    one = ((10.0, 0.01, ONE),)
    assert select_poles(made_table(one, scatter=(2e-3, 0.2)), rules=tight).pole.size == 0
    label = cluster_poles(
        made_table(one, scatter=(2e-3, 0.2), frequency_std_hz=np.full(size, 0.02), damping_std=np.full(size, 2e-3)),
        np.arange(size),
        tight.tolerance,
    )
    assert np.bincount(label).max() >= 28


def test_as_many_poles_as_the_largest_diagrams_have():
    # More pairs than are weighed at a time.
    table = made_table(THREE, strays=150, orders=range(2, 42))
    assert table.order.size**2 > 4 * PAIRS_TOGETHER
    np.testing.assert_allclose(select_poles(table).spread.frequency_hz, [10, 25, 40], rtol=1e-3)


@given(st.randoms(use_true_random=False))
def test_the_order_of_the_references_and_of_the_poles_at_one_order_does_not_matter(random):
    plain = made_table(THREE, orders=range(2, 12), strays=2)
    rows = list(zip(plain.order, plain.frequency_hz, plain.damping_ratio, plain.vector[:, ::-1], strict=True))
    random.shuffle(rows)
    shuffled = table_of(sorted(rows, key=lambda row: row[0]), range(2, 12))
    np.testing.assert_allclose(
        select_poles(shuffled).spread.frequency_hz, select_poles(plain).spread.frequency_hz, rtol=1e-12
    )


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"count": 0}, "count 0 must be at least 1"),
        ({"count": 1, "frequencies_hz": [2.0]}, "exclude each other"),
        ({"frequencies_hz": []}, "frequencies_hz is empty"),
        ({"frequencies_hz": [-1.0]}, "-1 Hz is not inside the positive"),
        ({"frequencies_hz": [float("nan")]}, "nan Hz is not inside"),
        ({"frequencies_hz": [30.0], "band_hz": (1.0, 20.0)}, "30 Hz is not inside the band 1 to 20 Hz"),
        ({"band_hz": (20.0, 1.0)}, "band 20 to 1 Hz must rise"),
    ],
)
def test_impossible_requests(wrong, says):
    with pytest.raises(SetupError, match=says):
        select_poles(made_table(THREE), **wrong)


@pytest.mark.parametrize(
    "wrong", [{"share": 0.0}, {"share": 1.5}, {"least_orders": 0}, {"damping": (0.2, 0.1)}, {"damping": (0.1, 1.0)}]
)
def test_impossible_rules(wrong):
    with pytest.raises(SetupError, match=r"must"):
        SelectionRules(**wrong)


@pytest.mark.parametrize("wrong", [{"frequency": 0.0}, {"damping": -1.0}, {"vector": 0.0}, {"orders": 0}])
def test_impossible_tolerances(wrong):
    with pytest.raises(SetupError, match=r"must be"):
        ClusterTolerance(**wrong)
