"""RESULTS.md says what the tables of the studies say."""

from compare.study import results


def test_the_page_is_that_of_the_tables():
    assert results.PAGE.read_text() == results.page()


def test_another_figure_in_a_table_is_seen(monkeypatch):
    read = results.read

    def other(path):
        table = read(path)
        return table.assign(error=table["error"] + 0.1) if path.name == "ladder.csv" else table

    monkeypatch.setattr(results, "read", other)
    assert results.PAGE.read_text() != results.page()
