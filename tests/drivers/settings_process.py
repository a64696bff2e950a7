# SPDX-License-Identifier: BSD-3-Clause
"""A program that is told settings, and answers what it did until then."""

import json
import subprocess
import sys


class SettingsProcess:
    """Its first line, and each answer to a line of its input, are JSON objects."""

    def __init__(self, program, *arguments):
        self.process = subprocess.Popen(
            [sys.executable, program, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.ports = json.loads(self.process.stdout.readline())

    def set(self, **settings):
        """Change settings; return what it did until then."""
        self.process.stdin.write(json.dumps(settings) + "\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())

    def close(self):
        self.process.stdin.close()
        self.process.wait(timeout=5)
        self.process.stdout.close()
