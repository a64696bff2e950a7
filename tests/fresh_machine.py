#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs README's two commands on minimal Debian systems, on a clone of this checkout.

sudo tests/fresh_machine.py [bookworm] [trixie]

Each system is made by debootstrap in a temporary folder (TMPDIR; 4 GB, on a file
system with devices) and takes this machine's mirrors, proxies, and certificates, but
nothing else. It prints a line for each step and ends with status 0 if all passed;
of a step that failed it prints the end of its output. What is mounted is mounted in
a namespace of the step, which ends with it and with all its processes: nothing is
left behind, also when interrupted.
"""

from __future__ import annotations

import argparse
import ast
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[1]
BUNDLE = Path("etc/ssl/certs/ca-certificates.crt")
NAMESPACE = ["unshare", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc"]


def output_of(*command: str) -> str:
    """Returns what a command prints, or nothing if it is missing or fails."""
    try:
        run = subprocess.run(command, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return ""
    return run.stdout


def mirror() -> list[str]:
    """Returns this machine's mirror of Debian, as an argument of debootstrap."""
    uris = output_of("apt-get", "indextargets", "--format", "$(REPO_URI)").split()
    return [uri for uri in uris if uri.rstrip("/").endswith("/debian")][:1]


def environment() -> dict[str, str]:
    """Returns the variables of a step: proxies, and pip's settings but for paths."""
    proxies = {
        name: value
        for name, value in os.environ.items()
        if name.lower() in ("http_proxy", "https_proxy", "no_proxy")
    }
    settings = re.findall(
        r"^.*\.([\w-]+)=('.*')$",
        output_of("python3", "-m", "pip", "config", "list"),
        re.M,
    )
    pip = {
        f"PIP_{name.upper().replace('-', '_')}": ast.literal_eval(value)
        for name, value in settings
    }
    return {
        "PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin",
        "HOME": "/root",
        "LANG": "C.UTF-8",
        **proxies,
        **{name: value for name, value in pip.items() if not value.startswith("/")},
    }


def take_settings(root: Path) -> None:
    """Lets a system reach the network as this machine does."""
    shutil.copy("/etc/hosts", root / "etc/hosts")
    shutil.copy("/etc/resolv.conf", root / "etc/resolv.conf")
    kept = re.compile(r'Acquire::(https?::|Check-|Retries).* ".+";$')
    lines = output_of("apt-config", "dump").splitlines()
    (root / "etc/apt/apt.conf.d/99host").write_text(
        "".join(f"{line}\n" for line in lines if kept.match(line))
    )
    # As an administrator adds certificates, so that they outlive the installation
    # of the package ca-certificates.
    names = ("PIP_CERT", "SSL_CERT_FILE", "REQUESTS_CA_BUNDLE", "CURL_CA_BUNDLE")
    given = [os.environ[name] for name in names if os.environ.get(name)]
    certificates = Path([*given, f"/{BUNDLE}"][0]).read_text()
    local = root / "usr/local/share/ca-certificates"
    for folder in (local, (root / BUNDLE).parent):
        folder.mkdir(parents=True, exist_ok=True)
    (root / BUNDLE).write_text(certificates)
    pattern = "-----BEGIN CERTIFICATE-----.*?-----END CERTIFICATE-----\n"
    for number, one in enumerate(re.findall(pattern, certificates, re.S)):
        (local / f"host-{number}.crt").write_text(one)


def try_system(name: str, folder: Path) -> bool:
    """Runs all steps on the Debian of that name; returns whether they passed."""
    root = folder / name
    clone = root / "root" / CHECKOUT.name
    variables = [f"{key}={value}" for key, value in environment().items()]

    def inside(command: str) -> list[str]:
        script = f"mount -t proc proc {root}/proc && exec " + shlex.join(
            ["chroot", str(root), "env", "-i", *variables, "sh", "-c", command]
        )
        return [*NAMESPACE, "sh", "-c", script]

    in_clone = f"cd /root/{CHECKOUT.name} && "
    steps = {
        "debootstrap": [
            *(*NAMESPACE, "debootstrap", "--variant=minbase", name, str(root)),
            *mirror(),
        ],
        "install git, make": inside(
            "apt-get update && apt-get install -y --no-install-recommends git make"
        ),
        "git clone": ["git", "clone", "--no-hardlinks", str(CHECKOUT), str(clone)],
        "make demo": inside(in_clone + "make demo"),
        "make test": inside(in_clone + "make test"),
    }
    for step, command in steps.items():
        if step == "install git, make":
            take_settings(root)
        log = folder / "log"
        began = time.monotonic()
        with log.open("w") as file:
            status = subprocess.run(
                command,
                stdin=subprocess.DEVNULL,
                stdout=file,
                stderr=subprocess.STDOUT,
                check=False,
            ).returncode
        seconds = time.monotonic() - began
        print(f"{name:9} {step:18} exit {status:<3} {seconds:5.0f} s", flush=True)
        if status != 0:
            lines = log.read_text(errors="replace").splitlines()[-40:]
            print(*lines, sep="\n", file=sys.stderr, flush=True)
            return False
    return True


def main() -> int:
    """Try the systems that are named; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    systems = ("bookworm", "trixie")
    parser.add_argument("system", nargs="*", help=f"default: {' '.join(systems)}")
    names = parser.parse_args().system or systems
    missing = [tool for tool in ("debootstrap", "unshare") if not shutil.which(tool)]
    if unknown := set(names) - set(systems):
        parser.error(f"expected {' or '.join(systems)}, got {' '.join(unknown)}")
    if missing or os.geteuid() != 0:
        parser.error(
            f"needs root, debootstrap and unshare; missing: {missing or 'root'}"
        )
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    folder = Path(tempfile.mkdtemp(prefix="fresh_machine."))
    try:
        passed = [try_system(name, folder) for name in names]
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        subprocess.run(["rm", "-rf", "--one-file-system", folder], check=True)
    return 0 if all(passed) else 1


if __name__ == "__main__":
    sys.exit(main())
