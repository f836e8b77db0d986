# SPDX-License-Identifier: Apache-2.0
"""Texts that a page must show as they are: markup, code, marks that turn text around, long ones."""

# What code among them would do; `ran` of the window says that it did.
RUN = "window.ran=1"

_HANDLERS = ("onload", "onerror", "onclick", "onmouseover", "onfocus", "onanimationstart",
             "ontoggle", "onpointerover", "onbeforeinput", "onbegin")
_VOID_TAGS = ("img", "svg", "body", "input autofocus", "iframe", "video", "object", "embed",
              "details open", "math", "marquee", "select autofocus")
_SCHEMES = ("javascript:", "JaVaScRiPt:", " javascript:", "java\tscript:", "java\nscript:",
            "vbscript:", "data:text/html,<script>", "data:image/svg+xml,<svg onload=>", "blob:",
            "file:///")
_TEMPLATES = ("{{%s}}", "{%%%s%%}", "${%s}", "#{%s}", "<%%=%s%%>", "[[%s]]", "{{constructor."
              "constructor('%s')()}}", "`${%s}`", "<!--#exec %s-->", "<?php %s ?>")
_BREAKS = ("\">", "'>", "-->", "</td>", "</option>", "</canvas>", "</title>", "</script>",
           "</style>", "</textarea>", "</noscript>", "]]>", "*/", "\\\"", "\\u003c", "%3C", "&lt;",
           "&#x3c;", "&#60", "\uff1c")
_MARKS = ("\u202e", "\u202d", "\u2066", "\u2067", "\u2068", "\u2069", "\u200e", "\u200f", "\u200b",
          "\u2028", "\u2029", "\ufeff", "\u00ad", "\u0301" * 40, "\U0001f468\u200d\U0001f469",
          "\U000e0041", "\ufffd", "\uffff", "\U0010ffff", "\x00", "\x01", "\x08", "\x1b[31m",
          "\x7f",
          "\r\n", "\n", "\t")
_WORDS = ("__proto__", "constructor", "toString", "hasOwnProperty", "null", "undefined", "NaN",
          "true", "-1", "1e999", "[object Object]", "%s%n%x", "../../etc/passwd", "' OR 1=1 --",
          "; rm -rf /", "$(reboot)", "|| ping", "=cmd|' /C calc'!A0", "@import 'x'",
          "expression(alert(1))", "url(javascript:1)", "<", ">", "&", "\"", "'", "`", "\\", "/",
          "O1", "H1", "id", " ", "  spaces  ", ".", "0")
_LONG = ("a" * 1024, "\u202e" * 300, "<b>" * 300, "\U0001f4a9" * 256, "word " * 200)


def all_payloads():
    """At least 150 different ones of at most 1024 bytes."""
    made = [f"<{tag} src=x {handler}={RUN}>" for tag, handler in
            zip(_VOID_TAGS, _HANDLERS + _HANDLERS)]
    made += [f"<{tag.split()[0]} {_HANDLERS[i % 10]}='{RUN}' style='animation:x 1s'>{tag}" for
             i, tag in enumerate(_VOID_TAGS)]
    made += [f"<script>{RUN}</script>", f"<script src=data:,{RUN}></script>",
             f"<SCRIPT\n>{RUN}</SCRIPT>", f"<scr<script>ipt>{RUN}</script>",
             f"<style>@import 'data:,{RUN}'</style>", "<link rel=stylesheet href=//127.0.0.1>",
             "<base href=//127.0.0.1/>", "<meta http-equiv=refresh content=0>",
             f"<form action=javascript:{RUN}><button>x", f"<a href=javascript:{RUN}>x</a>"]
    made += [f"\" {handler}=\"{RUN}\" x=\"" for handler in _HANDLERS]
    made += [scheme + RUN for scheme in _SCHEMES]
    made += [template % RUN for template in _TEMPLATES]
    made += [f"{end}<img src=x onerror={RUN}>" for end in _BREAKS]
    made += [f"a{mark}b<i>{RUN}" for mark in _MARKS]
    made += list(_WORDS) + list(_LONG)
    return list(dict.fromkeys(made))


# Of 4096 bytes, for texts that may have them.
LARGE = (f"<img src=x onerror={RUN}>" * 200)[:4096]
