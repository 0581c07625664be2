"""The clients of api/examples in other languages, each as its users build it, against config/examples/demo.yaml."""
import os
import pathlib
import signal
import subprocess
import unittest

from harness import AXISCTL, LIMIT, ROOT, Demo, pb, wait_for

EXAMPLES = ROOT / "api" / "examples"


def checked(words, **arguments):
    done = subprocess.run(words, capture_output=True, text=True, check=False, **arguments)
    if done.returncode != 0:
        raise AssertionError(f"{words}: {done.returncode}\n{done.stdout}{done.stderr}")


class ClientExamples(unittest.TestCase):
    def setUp(self):
        self.demo = Demo()
        self.addCleanup(self.demo.close)
        self.demo.client.wait_online("turntable")

    def start(self, words, *arguments):
        environment = os.environ | {"AXISD_SERVER": self.demo.server}
        process = subprocess.Popen([*words, *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                   env=environment)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def finish(self, process, status):
        output, _ = process.communicate(timeout=3 * LIMIT)
        self.assertEqual(process.returncode, status, output)
        return output

    def check_example(self, words):
        output = self.finish(self.start(words, "turntable", "30"), 0)
        self.assertRegex(output, r"\A(STATE_DISCRETE_MOTION -?[\d.]+ deg\n)+turntable: done\n\Z")
        self.assertIn("there is no axis 'nobody'; list them", self.finish(self.start(words, "nobody"), 1))

        def moving():
            return self.demo.client.state("turntable").moving
        process = self.start(words, "turntable", "36000")
        wait_for(moving, "the turntable moves")
        process.send_signal(signal.SIGINT)
        self.assertRegex(self.finish(process, 1), r"turntable: COMMAND_STATE_ABORTED: .*halt")
        self.assertEqual(self.demo.client.state("turntable").state, pb.STATE_STANDSTILL)

    def test_cpp(self):
        # Always the same folder of the build: a repetition compiles nothing.
        build = pathlib.Path(AXISCTL).parents[2] / "client-example"
        checked(["cmake", "-S", EXAMPLES / "cpp", "-B", build, "-G", "Ninja", "-DCMAKE_CXX_COMPILER=clang++-19",
                 "-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"])
        checked(["cmake", "--build", build, "--parallel", "2"])
        self.check_example([build / "axisd-example"])

    def test_node(self):
        if not (EXAMPLES / "node" / "node_modules").exists():
            self.fail("npm ci --ignore-scripts in api/examples/node (tests/run.sh does that)")
        self.check_example(["node", EXAMPLES / "node" / "example.mjs"])


if __name__ == "__main__":
    unittest.main()
