"""The interactive page in a real browser: search, filter, sort, cards, links and keys; hostile names stay text."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.page.interactive import SCRIPT, json_in_html
from asbuilt_bim.report.page.write import write_pages
from benchmarks.chromium import DRIVEN, Tab, opened_tab
from tests.report.page.test_first_screen import wanted
from tests.report.sample_report import (
    HOSTILE_FORMULA,
    HOSTILE_MARKUP,
    global_id,
    renamed,
    sample_picture,
    sample_report,
)

RIGHT_TO_LEFT = "\u202eعمود 12\u202c"
LONG = "W" * 300
IMAGE = '<img src=x onerror="document.title=1"></script><script>document.title=2</script>'
in_a_browser = pytest.mark.skipif(not DRIVEN, reason="no Chromium that can be driven is installed")


def hostile_report() -> ProgressReport:
    report = sample_report()
    for index, name in ((0, IMAGE), (5, RIGHT_TO_LEFT), (6, LONG)):
        report = renamed(report, index, name=name)
    storeys = (replace(report.storeys[0], name=IMAGE), *report.storeys[1:])
    tasks = tuple(replace(t, progress=replace(t.progress, name=IMAGE)) for t in report.tasks)
    return replace(report, storeys=storeys, tasks=tasks, project_name=IMAGE)


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    report = hostile_report()
    pictures = {station.name: sample_picture() for station in report.stations[:2]}
    earlier = replace(sample_report(), visit_date=sample_report().earlier_visits[0])
    return write_pages(report, pictures, tmp_path_factory.mktemp("page"), [earlier])[0]


@pytest.fixture(scope="module")
def browser() -> Iterator[Tab]:
    with opened_tab() as tab:
        yield tab


@pytest.fixture
def tab(browser: Tab, page: Path) -> Iterator[Tab]:
    """The page, open at a telephone's width; whatever a test does, it complains of nothing and asks for nothing."""
    browser.faults.clear()
    browser.asked.clear()
    browser.size(390)
    browser.open(page.as_uri())
    browser.until("document.documentElement.dataset.ready === 'yes'")
    yield browser
    assert browser.faults == [] and browser.asked == []
    assert browser.value("document.title").startswith("<img")  # no name ran


@in_a_browser
def test_a_name_of_300_letters_makes_neither_page_wider_than_the_screen(browser: Tab, tmp_path: Path) -> None:
    report = hostile_report()
    views = (wanted(report, 6, 0.0, 5.0), wanted(report, 0, 0.0, 5.0))
    storeys = tuple(replace(one, name=LONG) for one in report.storeys)
    write_pages(replace(report, wanted_views=views, storeys=storeys), {}, tmp_path)
    for name in ("report.html", "report-interactive.html"):
        for width in (320, 390, 1100, 1201):
            browser.size(width)
            browser.open((tmp_path / name).as_uri())
            assert browser.value("document.documentElement.scrollWidth") <= width, (name, width)


def names(tab: Tab) -> list[str]:
    found: list[str] = tab.value("[...document.querySelectorAll('#table tbody tr a')].map((one) => one.textContent)")
    return found


def put(tab: Tab, name: str, value: str) -> None:
    """Enter a value, in one go: a change of address that is still on its way would set the field back."""
    entered = f"field.value = {json.dumps(value)}, field.dispatchEvent(new Event('input', {{bubbles: true}}))"
    tab.value(f"((field) => ({entered}))(document.querySelector('[name={name}]'))")


def test_json_in_a_page_can_end_no_script_and_reads_back() -> None:
    value = {IMAGE: ["</script>", "<!--", "&amp;", "\u2028", RIGHT_TO_LEFT, HOSTILE_FORMULA]}
    text = json_in_html(value)
    assert not re.search("[<>&\u2028\u2029]", text) and json.loads(text) == value


def test_the_page_lets_run_its_own_script_alone(page: Path) -> None:
    html = page.read_text(encoding="utf-8")
    assert html.count("<script>") == 1 and "<img" not in html
    policy = r"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-[\w+/=]+'\""
    assert re.search(policy, html)
    assert not re.search(r"""(?:src|href)=["'](?!#|data:)""", html)


def test_the_script_makes_no_markup_of_a_value() -> None:
    script = SCRIPT.read_text(encoding="utf-8")
    assigned = [line for line in script.splitlines() if "innerHTML" in line]
    assert len(assigned) == 2 and not re.search(r"eval|outerHTML|insertAdjacent|document\.write", script)
    assert script.count("\n") < 300 and "</" not in script


@in_a_browser
def test_a_short_search_finds_names_and_no_globalid_that_holds_it_by_chance(tab: Tab) -> None:
    put(tab, "q", "glo")
    assert names(tab) == []
    put(tab, "q", global_id(3)[:12])
    assert names(tab) == ["W-01 east"]


@in_a_browser
def test_hostile_names_are_text_wherever_they_stand(tab: Tab) -> None:
    assert {IMAGE, HOSTILE_MARKUP, HOSTILE_FORMULA, RIGHT_TO_LEFT, LONG} <= set(names(tab))
    for index in (0, 2, 4, 5, 6):
        tab.value(f"location.hash = '#e={global_id(index)}'")
        tab.until(f"document.getElementById('card').dataset.ready === 'e {global_id(index)}'")
        assert tab.value("document.querySelectorAll('#card img, #card script').length") == 0
    assert tab.value("document.querySelectorAll('img').length") == 0
    assert tab.value("document.documentElement.scrollWidth") == 390


@in_a_browser
def test_a_search_finds_by_name_class_task_and_id_and_stands_in_the_address(tab: Tab) -> None:
    put(tab, "q", "ifcwall w-01")
    assert names(tab) == ["W-01 east"]
    put(tab, "q", global_id(7).lower())
    assert names(tab) == ["W-11"] and f"q={global_id(7).lower()}" in tab.value("location.hash")


@in_a_browser
def test_filters_and_order_come_back_from_the_address(tab: Tab, page: Path) -> None:
    put(tab, "class", "Column")
    put(tab, "sort", "-lower")
    first = names(tab)
    cells = "document.querySelectorAll('[data-label=\"at least\"]')"
    shares = tab.value(f"[...{cells}].map((one) => parseInt(one.textContent))")
    assert len(first) == 5 and shares == sorted(shares, reverse=True)
    address = tab.value("location.href")
    tab.open(page.as_uri())
    assert len(names(tab)) == 8
    tab.open(address)
    tab.until("document.documentElement.dataset.ready === 'yes'")
    assert names(tab) == first and tab.value("document.getElementById('count').textContent") == "5"
    tab.open(page.as_uri() + "#sort=__proto__&storey=nowhere&e=nobody")
    tab.until("!document.getElementById('missing').hidden")
    assert names(tab) == []


@in_a_browser
def test_elements_are_found_by_their_zone(browser: Tab, tmp_path: Path) -> None:
    report = sample_report()
    zones = [("Pour 1", IMAGE), ("Pour 1",), *[()] * 6]
    elements = tuple(replace(e, zones=own) for e, own in zip(report.elements, zones, strict=True))
    page = write_pages(replace(report, elements=elements), {}, tmp_path)[0]
    browser.open(page.as_uri() + "#zone=Pour+1")
    browser.until("document.documentElement.dataset.ready === 'yes'")
    assert len(names(browser)) == 2
    put(browser, "zone", IMAGE)
    assert len(names(browser)) == 1 and "zone=" in browser.value("location.hash")


@in_a_browser
def test_a_click_opens_a_card_arrows_go_on_and_escape_closes_it(tab: Tab) -> None:
    put(tab, "state", "unknown")
    order = names(tab)
    tab.click("#table tbody a")
    for name in order[:2]:
        tab.until(f"document.getElementById('card-title').textContent === {json.dumps(name)}")
        tab.key("ArrowRight")
    tab.key("Escape")
    tab.until("!document.getElementById('card').open && location.hash === '#state=unknown'")
    assert names(tab) == order


@in_a_browser
def test_a_slash_leads_to_the_search_and_the_back_button_leads_back(tab: Tab) -> None:
    tab.key("/")
    assert tab.value("document.activeElement.name") == "q"
    tab.type("C-1")
    assert names(tab) == []  # the two of that name bear hostile ones here
    tab.click("[type=reset]")
    assert len(names(tab)) == 8
    tab.value("history.back()")
    tab.until("document.getElementById('count').textContent === '0'")


@in_a_browser
def test_the_plan_leads_to_a_card_with_its_photo_and_pales_what_is_not_chosen(tab: Tab) -> None:
    tab.size(1280)
    tab.until("document.querySelectorAll('.floor svg').length")
    pale = "document.querySelectorAll('.floor a.pale').length"
    assert tab.value(pale) == 0
    put(tab, "q", "W-01 east")
    assert tab.value(pale) == 4
    tab.click(f".floor a[href='#e-{global_id(3)}']")
    tab.until(f"document.getElementById('card').dataset.ready === 'e {global_id(3)}'")
    pieces = "[...document.querySelectorAll('#card .cuts use')].map((one) => one.getAttribute('href'))"
    assert tab.value(f"{pieces}.length > 0 && {pieces}.every((one) => document.querySelector(one) !== null)")


@in_a_browser
def test_a_station_opens_with_its_picture(tab: Tab) -> None:
    tab.click("[data-station='A1']")
    tab.until("document.getElementById('card').dataset.ready === 's A1'")
    assert tab.value("document.querySelector('#card-body image, #symbols image') !== null")
    assert "s=A1" in tab.value("location.hash")


@in_a_browser
def test_a_card_leads_to_the_plan_and_a_search_stands_beside_what_it_found(tab: Tab, tmp_path: Path) -> None:
    report = sample_report()
    report = replace(report, wanted_views=(wanted(report, 3, 0.0, 5.0),))
    tab.open(write_pages(report, {}, tmp_path)[0].as_uri())
    tab.until("document.documentElement.dataset.ready === 'yes'")
    tab.click("nav a[href='#elements']")
    put(tab, "q", "w-01")
    assert tab.value("document.querySelector('#table tbody a').getBoundingClientRect().top") < 422  # half the screen
    tab.click("#table tbody a")
    tab.until(f"document.getElementById('card').dataset.ready === 'e {global_id(3)}'")
    tab.click("#card a[href='#plan-0']")
    tab.until("!document.getElementById('card').open && document.querySelectorAll('#plan-0[open] svg').length === 1")
    top = tab.value("document.getElementById('plan-0').getBoundingClientRect().top")
    assert -1 <= top < 844
    tab.value("document.title = '<img'")  # the fixture's page had such a name
