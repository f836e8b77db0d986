#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Texts of a map that would be markup or code stay text, wherever the viewer shows them."""

import re
import urllib.parse
import unittest

import payloads
import python_support  # Finds dsgdb.
import viewer_support
from viewer_support import READY

import dsgdb
from dsgdb import v1

PAYLOADS = payloads.all_payloads()
RELATION_BYTES_MAX = 64
REVISION_TEXT_MAX = 60
# Steps of one script, which may take half a minute.
STEPS_AT_ONCE = 20

# What of a page a text could have become.
TRACES = r"""
  const wrong = [];
  if (window.ran !== undefined) wrong.push('code ran');
  const text = document.body.innerText + document.body.textContent;
  if (/[\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]/.test(text)) wrong.push('turned text');
  if (document.title !== 'dsgdb') wrong.push('title ' + document.title);
  if (document.scripts.length !== 1) wrong.push(document.scripts.length + ' scripts');
  for (const one of document.querySelectorAll('*')) {
    if (!arguments[0].includes(one.localName)) wrong.push('element ' + one.localName);
    for (const {name, value} of one.attributes) {
      if (name.startsWith('on') || /javascript:|ran=1/.test(value)) wrong.push(name + '=' + value);
    }
  }
  return wrong;"""
# When the map is searched, on its own clock.
SEARCHED_NS = 2_000_000_000
ELEMENTS = ["html", "head", "body", "meta", "title", "link", "script", "noscript", "header",
            "label", "select", "option", "form", "input", "button", "span", "main", "aside", "div",
            "canvas", "p", "footer", "output", "dialog", "h2", "h3", "dl", "dt", "dd", "bdi",
            "table", "tbody", "tr", "th", "td", "kbd", "section", "details", "summary", "ul", "li"]


def cut(text, bytes_max):
    """As much of a text as the store takes."""
    return text.encode()[:bytes_max].decode(errors="ignore")


def shown(text):
    """A text as the page shows it: marks that turn the direction of writing by their number."""
    return re.sub("[\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]",
                  lambda mark: f"[U+{ord(mark[0]):04X}]", text)


class Hostile(viewer_support.ViewerTest):
    PEOPLE = 1
    SECONDS = 5

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        with dsgdb.open(cls.path("store"), writable=True) as db:
            cls.write(db.create_map("hostile", frame=cut(PAYLOADS[0], 256)))
            cls.write_history(db.create_map("told", frame=cut(PAYLOADS[0], 256)))
        cls.server, cls.url = cls.url, cls.url + "&map=hostile"

    @classmethod
    def write(cls, hostile):
        """Each payload in all texts of an object and of an edge."""
        session = hostile.session()
        session.commit(dsgdb.GraphDelta(
            layers=(v1.Layer(99, cut(PAYLOADS[0], 64), 9),), message=payloads.LARGE,
            nodes=(dsgdb.Node("X1", layer=cut(PAYLOADS[0], 64), kind="thing", name=PAYLOADS[2],
                              attributes={"x": dsgdb.AttributeValue(text=payloads.LARGE)}),
                   dsgdb.Node("H1", layer="agents", kind="human", name=PAYLOADS[0]),
                   dsgdb.Node("R1", layer="rooms", kind="room", name=PAYLOADS[1],
                              map_T_node=dsgdb.Pose(dsgdb.Vector3(5, 5, 0)),
                              bounding_box=dsgdb.Box(dsgdb.Vector3(-9, -9, 0),
                                                     dsgdb.Vector3(9, 9, 3))))))
        session.append_poses("H1", [("+1s", 1, 1, 0), ("+2s", 2, 2, 0)])
        nodes = tuple(dsgdb.Node(
            f"O{i}", layer="objects", kind=cut(text, RELATION_BYTES_MAX), name=text,
            semantic_class=dsgdb.SemanticLabel(i, text),
            map_T_node=dsgdb.Pose(dsgdb.Vector3(i % 13, i // 13, 0.5)),
            attributes={text: dsgdb.AttributeValue(text=text)})
                      for i, text in enumerate(PAYLOADS, 1))
        edges = tuple(dsgdb.Edge(f"O{i}", cut(text, RELATION_BYTES_MAX), "R1",
                                 attributes={text: dsgdb.AttributeValue(text=text)})
                      for i, text in enumerate(PAYLOADS, 1))
        session.commit(dsgdb.GraphDelta(nodes=nodes, edges=edges))

    @classmethod
    def write_history(cls, told):
        """Each payload as message and author of a revision, and as the note of a tag."""
        session = told.session()
        for i, text in enumerate(PAYLOADS, 1):
            node = dsgdb.Node("O1", layer="objects", kind="object", name=str(i))
            session.commit(dsgdb.GraphDelta(nodes=(node,), message=text, author=text))
            told.tag(f"t{i}", note=text.replace("\0", "")[:200])

    def setUp(self):
        self.window.messages()

    def nothing_ran(self):
        self.assertEqual([], self.window.run(TRACES, ELEMENTS))
        self.assertEqual([], self.window.messages())

    def controls_are_in_sight(self):
        """No text pushes the page's own controls out of the window."""
        self.assertEqual([], self.window.run("""
          return [...document.querySelectorAll('header button, footer select, #revision')]
              .filter((one) => one.checkVisibility())
              .filter((one) => one.getBoundingClientRect().right > innerWidth)
              .map((one) => one.id || one.textContent);"""))
        self.assertLessEqual(*self.window.run(
            "return [document.documentElement.scrollWidth, innerWidth]"))
        self.assertGreater(self.window.run(
            "return document.getElementById('scene').clientHeight"), 500)

    def test_table_and_inspector_show_every_text_as_it_is(self):
        self.assertGreaterEqual(len(PAYLOADS), 150)
        self.open()
        self.window.keys("t")
        self.window.wait(f"document.querySelectorAll('#table tr').length > {len(PAYLOADS)}")
        rows = {row[0]: row for row in self.window.run("""
            return [...document.querySelectorAll('#table tr')].slice(1).map((row) =>
                [row.cells[0].textContent, row.querySelector('.link').textContent,
                 row.cells[2].textContent, row.cells[3].textContent]);""")}
        for i, text in enumerate(PAYLOADS, 1):
            short = cut(text, RELATION_BYTES_MAX)
            self.assertEqual([f"O{i}", shown(text), shown(short), shown(text)], rows[f"O{i}"])
        self.assertEqual([PAYLOADS[0], PAYLOADS[1]], [rows["H1"][1], rows["R1"][1]])
        seen = []
        for begin in range(0, len(PAYLOADS), STEPS_AT_ONCE):
            seen += self.window.run("""
              const inspector = document.getElementById('inspector');
              const facts = () => [...inspector.querySelectorAll('dd')].map(
                  (one) => one.textContent);
              const select = async (i) => {
                [...document.querySelectorAll('#table tr')].find(
                    (row) => row.cells[0].textContent === `O${i}`).querySelector('.link').click();
                while (facts()[0] !== `O${i}` || !inspector.querySelector('.link')) {
                  await new Promise((done) => setTimeout(done, 5));
                }
                return [inspector.querySelector('h2').textContent, facts()[1], facts()[3],
                        inspector.querySelector('h3 + div').textContent];
              };
              const [begin, end] = arguments;
              return (async () => {
                const seen = [];
                for (let i = begin; i <= end; ++i) seen.push(await select(i));
                return seen;
              })();""", begin + 1, min(begin + STEPS_AT_ONCE, len(PAYLOADS)))
        for text, said in zip(PAYLOADS, seen, strict=True):
            short = shown(cut(text, RELATION_BYTES_MAX))
            self.assertEqual([shown(text), short, shown(text), f"{short} {PAYLOADS[1]}"], said)
        # Of the room all relations are shown at once.
        self.window.run("""[...document.querySelectorAll('#table tr')].find(
            (row) => row.cells[0].textContent === 'R1').querySelector('.link').click()""")
        self.window.wait(f"document.querySelectorAll('#inspector h3 ~ div').length === "
                         f"{len(PAYLOADS)}")
        self.assertGreater(int(self.window.run("return document.body.dataset.labels")), 0)
        self.nothing_ran()
        self.controls_are_in_sight()

    def test_messages_and_authors_of_revisions_and_notes_of_tags_stay_text(self):
        self.go(self.server + "&map=told")
        self.window.wait(READY)
        head = len(PAYLOADS)
        seen = []
        for begin in range(0, head, STEPS_AT_ONCE):
            seen += self.window.run("""
              const body = document.body.dataset;
              return (async () => {
                const seen = [];
                for (let i = 0; i < arguments[0]; ++i) {
                  const before = body.revision;
                  seen.push(document.getElementById('revision-text').textContent);
                  document.dispatchEvent(new KeyboardEvent('keydown', {key: '['}));
                  while (body.revision === before || body.state !== 'ready') {
                    await new Promise((done) => setTimeout(done, 5));
                  }
                }
                return seen;
              })();""", min(STEPS_AT_ONCE, head - begin - 1))
        for i, said in zip(range(head, 1, -1), seen, strict=True):
            whole = shown(f"{i} of {head} (t{i}) {PAYLOADS[i - 1]}")
            due = whole if len(whole) <= REVISION_TEXT_MAX else \
                whole[:REVISION_TEXT_MAX - 1] + "\u2026"
            self.assertEqual(due, said)
        self.nothing_ran()
        self.controls_are_in_sight()

    def test_what_is_searched_for_stays_text(self):
        self.open(f"&at={SEARCHED_NS}")
        with dsgdb.open(self.server) as db:
            for text in PAYLOADS + [payloads.LARGE]:
                asked, said = self.window.run("""
                  const [query, found] = ['query', 'found'].map(
                      (id) => document.getElementById(id));
                  query.value = arguments[0];
                  query.form.requestSubmit();
                  const asked = query.value;
                  return (async () => {
                    while (asked && !found.textContent) {
                      await new Promise((done) => setTimeout(done, 2));
                    }
                    return [asked, found.textContent];
                  })();""", text)
                due = shown(self.answer(db.map("hostile"), asked))
                self.assertIn(due, (said, said.partition(", true at ")[0]), repr(text))
        self.controls_are_in_sight()
        self.assertEqual([], self.window.run(TRACES, ELEMENTS))
        # A question that the server refuses is an error of the network for the console.
        self.assertEqual([], [one for one in self.window.messages() if "SearchNodes" not in one])

    def answer(self, hostile, query):
        """What the page is to say of a query, by another client."""
        if not query:
            return ""
        try:
            reply = hostile.api.search_nodes(v1.SearchNodesRequest(
                map="hostile", query=query, at_ns=SEARCHED_NS, page_size=1000))
            return f"{len(reply.hits)} found"
        except dsgdb.Error as error:
            return error.message

    def test_names_of_what_is_found_stay_text(self):
        self.open(f"&at={SEARCHED_NS}&q=any")
        names = self.window.run("""return Object.fromEntries(
            [...document.querySelectorAll('#hits button')].map(
                (one) => [one.dataset.id, one.textContent]));""")
        for i, text in enumerate(PAYLOADS, 1):
            self.assertEqual(shown(text), names.get(f"O{i}"), repr(text))
        self.nothing_ran()
        self.controls_are_in_sight()

    def test_an_address_is_no_markup_either(self):
        for text in PAYLOADS[::25]:
            quoted = urllib.parse.quote(text)
            self.go(f"{self.server}&map={quoted}")
            self.window.wait("document.body.dataset.state === 'error'")
            self.assertIn(shown(text[:100]), self.text("banner"))
            self.assertEqual([], self.window.run(TRACES, ELEMENTS))
            more = "&".join(f"{key}={quoted}" for key in ("sel", "hide", "q", "cam", "at", "rev",
                                                          "diff", "explode", "live"))
            self.go(f"{self.url}&{more}")
            self.window.wait(READY)
            self.assertEqual([], self.window.run(TRACES, ELEMENTS))
            self.controls_are_in_sight()
        quiet = ("SearchNodes", "GetNode", "GetMapStats")
        self.assertEqual([], [one for one in self.window.messages()
                              if not any(call in one for call in quiet)])


if __name__ == "__main__":
    unittest.main()
