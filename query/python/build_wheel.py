# SPDX-License-Identifier: Apache-2.0
"""The build backend of PEP 517, so that `pip install` needs nothing but pip: no setuptools, no
network. The same files give the same bytes.
"""

import base64
import hashlib
import io
import os
import re
import tarfile
import zipfile

HERE = os.path.dirname(os.path.abspath(__file__))
WHEEL = "Wheel-Version: 1.0\nGenerator: dsgdb\nRoot-Is-Purelib: true\nTag: py3-none-any\n"


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    version = package_version()
    info = f"dsgdb-{version}.dist-info"
    files = {name: read(name) for name in package_files()}
    files[f"{info}/METADATA"] = metadata(version).encode()
    files[f"{info}/WHEEL"] = WHEEL.encode()
    record = [f"{name},sha256={digest(data)},{len(data)}" for name, data in files.items()]
    files[f"{info}/RECORD"] = "\n".join([*record, f"{info}/RECORD,,", ""]).encode()
    wheel = f"dsgdb-{version}-py3-none-any.whl"
    with zipfile.ZipFile(os.path.join(wheel_directory, wheel), "w", zipfile.ZIP_DEFLATED) as target:
        for name, data in files.items():
            target.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED)
    return wheel


def build_sdist(sdist_directory, config_settings=None):
    version = package_version()
    files = {name: read(name) for name in [*package_files(), "build_wheel.py", "pyproject.toml"]}
    files["PKG-INFO"] = metadata(version).encode()
    archive = f"dsgdb-{version}.tar.gz"
    with tarfile.open(os.path.join(sdist_directory, archive), "w:gz") as target:
        for name, data in files.items():
            member = tarfile.TarInfo(f"dsgdb-{version}/{name}")
            member.size = len(data)
            target.addfile(member, io.BytesIO(data))
    return archive


def metadata(version):
    extras = {"numpy": "numpy>=1.20", "pandas": "pandas>=1.3", "networkx": "networkx>=2.6"}
    lines = ["Metadata-Version: 2.1", "Name: dsgdb", f"Version: {version}",
             "Summary: Asks a store of 3-D dynamic scene graphs who and what was where",
             "License: Apache-2.0", "Requires-Python: >=3.9"]
    for extra, requirement in extras.items():
        lines += [f"Provides-Extra: {extra}", f'Requires-Dist: {requirement}; extra == "{extra}"']
    return "\n".join(lines) + "\n"


def package_version():
    return re.search(r'^VERSION = "(.+)"', read("dsgdb/v1.py").decode(), re.MULTILINE).group(1)


def package_files():
    return sorted(f"dsgdb/{name}" for name in os.listdir(os.path.join(HERE, "dsgdb"))
                  if name.endswith(".py") or name == "py.typed")


def read(name):
    with open(os.path.join(HERE, name), "rb") as f:
        return f.read()


def digest(data):
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
