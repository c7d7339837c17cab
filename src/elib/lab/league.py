"""A league: every two submissions play a game of two programs, each once on either side, and a table says who leads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from html import escape
from itertools import permutations

from elib.base.plaintext import plain
from elib.lab.labfile import Lab
from elib.lab.marking import Mark
from elib.lab.marksheet import PAGE, told
from elib.lab.submissions import Submission

FOR_WON, FOR_DRAWN = 3, 1
"""Points of a game."""

Game = Sequence[Mark]
"""The marks of the two programs that played in all variants; the first one had the first half of the robots."""


@dataclass(slots=True)
class Standing:
    """A row of the table."""

    name: str  # the submission's
    won: int = 0
    drawn: int = 0
    lost: int = 0
    remarks: list[str] = field(default_factory=list)
    alike: dict[str, int] = field(default_factory=dict)

    @property
    def games(self) -> int:
        """How many games it played."""
        return self.won + self.drawn + self.lost

    @property
    def points(self) -> int:
        """What its games are worth."""
        return FOR_WON * self.won + FOR_DRAWN * self.drawn


def pairs(submissions: Sequence[Submission]) -> list[tuple[Submission, Submission]]:
    """Return who plays whom: every two, each once as the first."""
    return list(permutations(submissions, 2))


def outcome(game: Game, place: int) -> tuple[str, str]:
    """Return what a variant, by its place, was for the first program and for the second: won, drawn or lost.

    A program that failed has lost, and a game in which both failed is lost for both.
    """
    first, second = (mark.reached[place] for mark in game)
    if first == second:
        return ("lost", "lost") if first < 0 else ("drawn", "drawn")
    return ("won", "lost") if first > second else ("lost", "won")


def standings(games: Sequence[Game]) -> list[Standing]:
    """Return the table: most points first, then most games won, then by name."""
    table: dict[str, Standing] = {}
    for game in games:
        for player, mark in enumerate(game):
            row = table.setdefault(mark.name, Standing(mark.name))
            found = [outcome(game, place)[player] for place in range(len(mark.reached))]
            row.won += found.count("won")
            row.drawn += found.count("drawn")
            row.lost += found.count("lost")
            row.remarks += [each for each in mark.remarks if each not in row.remarks]
    return sorted(table.values(), key=lambda row: (-row.points, -row.won, row.name))


def to_rows(table: Sequence[Standing]) -> list[list[str]]:
    """Return the heading and the rows."""
    rows = [["submission", "games", "won", "drawn", "lost", "points", "remarks", "similar"]]
    for row in table:
        alike = ", ".join(f"{name} ({share} %)" for name, share in row.alike.items())
        numbers = map(str, (row.games, row.won, row.drawn, row.lost, row.points))
        rows.append([row.name, *numbers, "; ".join(row.remarks), alike])
    return [[plain(cell) for cell in row] for row in rows]


def to_json(lab: Lab, table: Sequence[Standing], games: Sequence[Game]) -> dict[str, object]:
    """Return table and games as values for JSON; the pictures are left out."""
    keys = ("name", "games", "won", "drawn", "lost", "points", "remarks", "alike")
    return {
        "lab": lab.title,
        "variants": [variant.name for variant in lab.variants],
        "table": [{key: getattr(row, key) for key in keys} for row in table],
        "games": [
            {
                "players": [mark.name for mark in game],
                "variant": variant.name,
                "results": outcome(game, place),
                "goals": [_goals(mark, place) for mark in game],
            }
            for game in games
            for place, variant in enumerate(lab.variants)
        ],
    }


def _goals(mark: Mark, place: int) -> dict[str, object]:
    # A program that failed has reached nothing, and after a failure the other variants are not run.
    runs = mark.runs[place : place + 1] if mark.reached[place] >= 0 else []
    return {each.goal.name: {"holds": each.holds, "text": each.text} for run in runs for each in run.goals}


def to_html(lab: Lab, table: Sequence[Standing], games: Sequence[Game]) -> str:
    """Return a page that needs nothing beside it: the table, and each game with its picture and what happened."""
    heading, *rows = to_rows(table)
    number = sum(row.games for row in table) // 2
    return PAGE.format(
        title=escape(lab.title),
        summary=f"{len(table)} programs, {number} games in {len(lab.variants)} variants."
        f" A game that is won has {FOR_WON} points, one that is drawn {FOR_DRAWN}.",
        head="".join(f"<th>{cell}</th>" for cell in heading),
        body="".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>\n" for row in rows),
        details="\n".join(_details(game) for game in games),
    )


def _details(game: Game) -> str:
    names = [escape(plain(mark.name)) for mark in game]
    figures = ""
    for place, runs in enumerate(zip(*(mark.runs for mark in game), strict=True)):
        sides = "".join(
            f"<p><b>{name} {result}</b></p>{told(run if mark.reached[place] >= 0 else replace(run, goals=()))}"
            for name, result, run, mark in zip(names, outcome(game, place), runs, game, strict=True)
        )
        figures += f"<figure><figcaption>{escape(runs[0].variant)}</figcaption>{runs[0].picture}{sides}</figure>"
    return f'<section><h2>{names[0]} against {names[1]}</h2><div class="runs">{figures}</div></section>'
