"""What is kept of what was made."""

from threading import Barrier, Thread

from chladni.gap.plant.kept import Kept


def test_what_nobody_asked_for_longest_goes_first() -> None:
    made: list[str] = []

    def make(name: str) -> str:
        made.append(name)
        return name

    kept: Kept[str] = Kept(2)
    for name in ("a", "b", "a", "c", "a", "b"):
        assert kept.get(name, lambda name=name: make(name)) == name
    assert made == ["a", "b", "c", "b"]


def test_what_is_taken_is_nobody_elses_until_it_is_put_back() -> None:
    kept: Kept[list[int]] = Kept(2)
    mine = kept.take("table", list)
    other = kept.take("table", list)
    assert mine is not other
    kept.put("table", mine)
    assert kept.take("table", list) is mine


def test_threads_that_ask_for_much_at_once_get_what_they_asked_for() -> None:
    kept: Kept[int] = Kept(3)
    start, wrong = Barrier(4, timeout=30.0), []

    def ask(first: int) -> None:
        start.wait()
        for step in range(2000):
            key = (first * step) % 7
            if kept.get(key, lambda key=key: key) != key:
                wrong.append(key)
            if kept.take(key, lambda key=key: key) != key:
                wrong.append(key)
            kept.put(key, key)

    threads = [Thread(target=ask, args=(first,)) for first in (1, 2, 3, 5)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert wrong == []
