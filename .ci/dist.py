"""Packs the archives and the wheel of `make dist`; called by .ci/dist. Equal inputs give equal bytes."""

import base64
import collections
import gzip
import hashlib
import io
import json
import os
import pathlib
import re
import subprocess
import sys
import tarfile
import zipfile

target, dist = map(pathlib.Path, sys.argv[1:])
DOC = "share/doc/orator"
# Libraries that every system with this C library has; all others are packed.
SYSTEM = re.compile(r"(linux-vdso|ld-linux-x86-64|libc|libm|libdl|librt|libpthread|libstdc\+\+|libgcc_s)\.so")
MAX_BYTES = 90_000_000
STATEMENT = """orator is distributed under the MIT licence (orator.txt). The archive as a whole is distributed under the GNU General
Public License, version 3 or later (GPL-3.txt): it contains libx264 (GPL version 2 or later), without which films could
not be written as H.264, and OpenCV and Rust packages under the Apache License 2.0, which that version permits.
Debian's source packages are available with `apt-get source NAME=VERSION`.

"""


def run(*command, **environment):
    return subprocess.run(command, check=True, capture_output=True, text=True, env=os.environ | environment).stdout


def libraries():
    """Libraries that the program loads, by file name: those of .ci/dist first, then those of the system."""
    found = {}
    for line in run("ldd", target / "release/orator", LD_LIBRARY_PATH=str(dist / "lib")).splitlines():
        name, *path = line.strip().split(" (")[0].split(" => ")
        if not SYSTEM.match(pathlib.Path(name).name):
            found[name] = pathlib.Path(*path)
    runtime = max((target / "lib").glob("libonnxruntime.so*"))
    return found | {runtime.name: runtime}


def crate_licences():
    """The licence texts of all Rust packages in the program, each with the packages that have it."""
    metadata = json.loads(run("cargo", "metadata", "--locked", "--format-version=1", "--filter-platform=x86_64-unknown-linux-gnu"))
    packages = {package["id"]: package for package in metadata["packages"]}
    nodes = {node["id"]: node["deps"] for node in metadata["resolve"]["nodes"]}
    todo = [id for id, package in packages.items() if package["name"] in ("orator", "orator-lab") and not package["source"]]
    linked = set()
    while todo:
        if (id := todo.pop()) not in linked:
            linked.add(id)
            todo += [dep["pkg"] for dep in nodes[id] if any(kind["kind"] is None for kind in dep["dep_kinds"])]
    texts = collections.defaultdict(set)
    for package in (packages[id] for id in linked if packages[id]["source"]):
        files = pathlib.Path(package["manifest_path"]).parent.iterdir()
        named = [file for file in files if re.match(r"(?i)(un)?licen[cs]e|copying|copyright|notice", file.name) and file.is_file()]
        name = f"{package['name']} {package['version']} ({package['license']})"
        no_text = f"The package contains no licence text. Authors: {', '.join(package['authors']) or package['repository']}\n"
        for text in [file.read_text(errors="replace") for file in named] or [no_text]:
            texts[text].add(name)
    return "\n\n".join(sorted("\n".join(sorted(names)) + "\n\n" + text for text, names in texts.items()))


def licences(linked):
    """Licence texts by file name, with a list of all parts."""
    doc = pathlib.Path(run("rustc", "--print", "sysroot").strip()) / "share/doc/rust"
    files = {"orator.txt": "LICENSE", "rust-standard-library.html": doc / "COPYRIGHT-library.html"}
    files |= {f"onnxruntime-{name}": target / "lib" / name for name in ("LICENSE", "ThirdPartyNotices.txt")}
    files |= {f"{name}.txt": f"/usr/share/common-licenses/{name}" for name in ("GPL-2", "GPL-3", "LGPL-2.1", "Apache-2.0")}
    parts = {"rust-packages.txt": "all Rust packages that are linked, with versions and licences"}
    files["ffmpeg.txt"] = dist / "ffmpeg.copyright"
    version = next((dist / "sources").glob("ffmpeg_*.dsc")).stem.split("_")[1]
    parts["ffmpeg.txt"] = f"Debian source package ffmpeg={version}, built with fewer parts"
    for name, path in linked.items():
        if path.parent not in (dist / "lib", target / "lib"):
            path = path.resolve()
            package = run("dpkg", "-S", f"*/{path.parent.name}/{path.name}").split(":")[0]
            files[f"{package}.txt"] = f"/usr/share/doc/{package}/copyright"
            parts[f"{package}.txt"] = run("dpkg-query", "-W", "-f", "Debian source package ${source:Package}=${source:Version}", package)
    texts = {name: pathlib.Path(path).read_bytes() for name, path in files.items()} | {"rust-packages.txt": crate_licences().encode()}
    listed = "".join(f"{name}: {parts.get(name, 'licence text')}\n" for name in sorted(texts))
    return {f"{DOC}/licences/{name}": text for name, text in (texts | {"README.txt": (STATEMENT + listed).encode()}).items()}


def program(name):
    """The program, which looks for its libraries in lib/orator beside its folder, before LD_LIBRARY_PATH."""
    copy = dist / name
    copy.write_bytes((target / "release" / name).read_bytes())
    copy.chmod(0o755)
    run("patchelf", "--force-rpath", "--set-rpath", "$ORIGIN/../lib/orator", copy)
    content = copy.read_bytes()
    copy.unlink()
    return {f"bin/{name}": content}


def documentation():
    orator = target / "release/orator"
    run(orator, "man", dist / "man")
    files = {f"share/man/man1/{page.name}": page.read_bytes() for page in (dist / "man").iterdir()}
    files |= {f"{DOC}/guide/{page.name}": page.read_bytes() for page in pathlib.Path("src/guide").glob("*.md")}
    completions = {"bash": "bash-completion/completions/orator", "zsh": "zsh/site-functions/_orator", "fish": "fish/vendor_completions.d/orator.fish"}
    return files | {f"share/{path}": run(orator, "completions", shell).encode() for shell, path in completions.items()}


def mode(path):
    return 0o755 if path.startswith("bin/") else 0o644


def write_archive(name, files):
    path = dist / f"{name}.tar.gz"
    with path.open("wb") as out, gzip.GzipFile("", "wb", 6, out, mtime=0) as packed:
        with tarfile.open(fileobj=packed, mode="w", format=tarfile.GNU_FORMAT) as tar:
            for at in sorted(files):
                entry = tarfile.TarInfo(f"{name}/{at}")
                entry.size, entry.mode, entry.mtime = len(files[at]), mode(at), 315532800
                tar.addfile(entry, io.BytesIO(files[at]))
    return path


def write_wheel(version, glibc, files):
    tag = f"py3-none-manylinux_2_{glibc}_x86_64"
    path, info = dist / f"orator-{version}-{tag}.whl", f"orator-{version}.dist-info"
    packed = {re.sub("^bin/", "scripts/", re.sub("^(lib|share)/", r"data/\1/", at)): at for at in files}
    entries = {f"orator-{version}.data/{name}": (files[at], mode(at)) for name, at in packed.items()}
    entries[f"{info}/METADATA"] = (
        f"Metadata-Version: 2.1\nName: orator\nVersion: {version}\nLicense: GPL-3.0-or-later\nRequires-Python: >=3.7\n"
        "Summary: Videos of one speaker to a 3D gesture dataset, and to a model that gestures like that speaker\n"
    ).encode(), 0o644
    entries[f"{info}/WHEEL"] = f"Wheel-Version: 1.0\nGenerator: orator\nRoot-Is-Purelib: false\nTag: {tag}\n".encode(), 0o644
    digest = lambda content: base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
    record = "".join(f"{at},sha256={digest(content)},{len(content)}\n" for at, (content, _) in sorted(entries.items()))
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as wheel:
        for at, (content, bits) in [*sorted(entries.items()), (f"{info}/RECORD", (f"{record}{info}/RECORD,,\n".encode(), 0o644))]:
            entry = zipfile.ZipInfo(at)
            entry.external_attr, entry.compress_type = (0o100000 | bits) << 16, zipfile.ZIP_DEFLATED
            wheel.writestr(entry, content)
    return path


linked = libraries()
shared = {f"lib/orator/{name}": path.read_bytes() for name, path in linked.items()} | licences(linked)
shared |= {f"{DOC}/models/{page.name}": page.read_bytes() for page in pathlib.Path("models").glob("*.md")}
version = run(target / "release/orator", "--version").split()[1]
orator = program("orator") | shared | documentation()
symbols = run("objdump", "-T", target / "release/orator", target / "release/orator-lab", *linked.values())
glibc = max(int(minor) for minor in re.findall(r"\bGLIBC_2\.(\d+)", symbols))
for old in [*dist.glob("*.whl"), *dist.glob("*.tar.gz")]:
    old.unlink()
for path in (
    write_archive(f"orator-{version}-linux-x86_64", orator),
    write_archive(f"orator-lab-{version}-linux-x86_64", program("orator-lab") | shared),
    write_wheel(version, glibc, orator),
):
    size = path.stat().st_size
    print(f"{path}: {size / 1e6:.1f} MB, sha256 {hashlib.sha256(path.read_bytes()).hexdigest()}")
    if size > MAX_BYTES:
        sys.exit(f"{path} is larger than {MAX_BYTES / 1e6:.0f} MB")
