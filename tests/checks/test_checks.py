"""The checks themselves: each rule is broken once in a tree of its own, and must be found; a good tree must pass."""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import documents
import layering
import members
import texts

GOOD = {
    "buses/clock.cpp": "auto t = std::chrono::steady_clock::now();\n",
    "buses/asio_clock.hpp": "#include <boost/asio/steady_timer.hpp>\nboost::asio::steady_timer timer_;\n",
    "buses/modbus_rtu/port.cpp": '#include <modbus/modbus.h>\n\n#include "buses/clock.hpp"\n',
    "buses/can/socket.cpp": "#include <linux/can/raw.h>\n#include <linux/can.h>\n",
    "devices/axis/axis.cpp": '#include "buses/signal.hpp"\nco_await sleep_until(executor, clock, when);\n'
                             '// never steady_clock::now()\nlog("sleep_for(1)");\n',
    "devices/m1/descriptor.cpp": '#include "devices/m1/drive.hpp"\n',
    "devices/m1/drive.cpp": '#include "devices/m1/drive.hpp"\n#include "devices/m1/registers.hpp"\n',
    "devices/m1/simulator.cpp": '#include "devices/m1/registers.hpp"\n#include "devices/m1/simulator_motor.hpp"\n'
                                '#include "devices/simulation/simulator.hpp"\n',
    "config/loader.cpp": '#include <yaml-cpp/yaml.h>\n\n#include "devices/axis/settings.hpp"\n',
    "api/server/axis.cpp": '#include <grpcpp/grpcpp.h>\n\n#include "axisd/v1/types.pb.h"\n#include "devices/machine.hpp"\n',
    "api/axisctl/main.cpp": '#include <CLI/CLI.hpp>\n\n#include "config/configuration.hpp"\n',
    "daemon/main.cpp": '#include <systemd/sd-daemon.h>\n#include <CLI/CLI.hpp>\n#include "api/server/server.hpp"\n',
    "daemon/core/core.cpp": "#include <boost/asio/io_context.hpp>\n",
    "tests/unit/buses/queue_test.cpp": '#include "anything/at/all.hpp"\n',
    "README.md": "A stop, a halt and a quick stop. Timestops and estopple are words. See /workshop and ../work/x.\n",
    "deploy/run.sh": "mktemp -d name.XXXXXX\n",
    "docs/rules.md": "## M1 Nothing by itself\n\nEnforced:\n\n- `devices/m1/drive.cpp`,\n  `buses/`: `include`\n\n"
                     "## M14 Stop\n",
    "CONTRIBUTING.md": "`devices/MODEL/drive.cpp`, `devices/*/simulator.cpp`, `buses/`, `mm/s`, `build/dev/x`,\n"
                       "[rules](docs/rules.md#m14-stop), [elsewhere](https://example.org/x).\n",
    "tests/rules/m01_test.cpp": "TEST(M01, NothingByItself) {}\nTEST(M14Holds, Each) {}  // a line: d='M90.0 1L2'\n",
}

BAD_INCLUDES = {  # path -> (text, what the finding says)
    "buses/a.cpp": ('#include "devices/drive.hpp"', "may include only buses/"),
    "buses/b.cpp": ("#include <modbus/modbus.h>", "modbus belongs to"),
    "buses/modbus_rtu/c.cpp": ("#include <linux/can.h>", "linux/can belongs to"),
    "buses/d.hpp": ('  #  include   "config/configuration.hpp"', "may include only"),
    "devices/a.cpp": ('#include "config/configuration.hpp"', "may include only"),
    "devices/b.cpp": ("#include <boost/asio/post.hpp>", "boost/asio belongs to"),
    "devices/axis/c.cpp": ('#include "devices/m1/drive.hpp"', "descriptor only"),
    "devices/axis/d.cpp": ('#include "devices/simulation/simulator.hpp"', "only simulators"),
    "devices/m2/descriptor.cpp": ('#include "devices/m1/registers.hpp"', "descriptor only"),
    "devices/m1/e.cpp": ('#include "devices/m1/simulator.hpp"', "share the register table only"),
    "devices/m1/simulator_f.cpp": ('#include "devices/m1/drive.hpp"', "share the register table only"),
    "devices/m1/simulator_g.cpp": ('#include "devices/m1/codec.hpp"', "share the register table only"),
    "devices/m1/h.cpp": ('#include "devices/simulation/pty_line.hpp"', "only simulators"),
    "devices/drive.hpp": ('#include "devices/axis/settings.hpp"', "knows nothing of the axis"),
    "devices/m1/i.cpp": ('#include "devices/axis/axis.hpp"', "knows nothing of the axis"),
    "config/a.cpp": ('#include "api/server/server.hpp"', "may include only"),
    "config/b.cpp": ("#include <grpcpp/grpcpp.h>", "grpcpp belongs to"),
    "config/c.cpp": ('#include <axisd/v1/types.pb.h>', "may include only"),
    "api/server/a.cpp": ('#include "config/configuration.hpp"', "may include only"),
    "api/server/b.cpp": ('#include "daemon/core/machine_core.hpp"', "may include only"),
    "api/server/c.cpp": ("#include <yaml-cpp/yaml.h>", "yaml-cpp belongs to"),
    "api/axisctl/a.cpp": ('#include "devices/axis/axis.hpp"', "may include only"),
    "api/axisctl/b.cpp": ('#include "api/server/status.hpp"', "may include only"),
    "api/other/c.cpp": ('#include "buses/clock.hpp"', "no include rule"),
    "daemon/core/a.cpp": ('#include "api/server/server.hpp"', "may include only"),
    "daemon/core/beast.cpp": ("#include <boost/beast/http.hpp>", "boost/beast belongs to"),
    "daemon/core/b.cpp": ("#include <google/protobuf/message.h>", "google belongs to"),
    "daemon/store/c.cpp": ('#include "config/configuration.hpp"', "may include only"),
    "daemon/d.cpp": ('#include "tests/support/rig.hpp"', "may include only"),
    "devices/s.cpp": ("#include <systemd/sd-daemon.h>", "systemd belongs to"),
    "config/cli.cpp": ("#include <CLI/CLI.hpp>", "CLI belongs to"),
}

BAD_TIME = {
    "devices/axis/t1.cpp": "auto t = std::chrono::steady_clock::now();",
    "daemon/t2.cpp": "boost::asio::steady_timer timer(io);",
    "api/server/t3.cpp": "std::this_thread::sleep_for(1ms);",
    "buses/t4.cpp": "usleep(10);",
    "buses/t5.cpp": "/* a comment */ nanosleep (&t, nullptr);",
    "api/axisctl/t6.cpp": "clock.sleep_for(1ms);",
    "config/t7.cpp": "auto t = std::chrono::high_resolution_clock::now();",
    "tests/unit/devices/t8.cpp": "std::this_thread::sleep_until(t);",
}

BAD_TEXTS = {
    "a.md": ("press the e-stop now", "say stop"),
    "b.hpp": ("/// Estop.", "say stop"),
    "c.yaml": ("# a safe stop", "say stop"),
    "d.cpp": ("// TODO: later", "leftover"),
    "e.py": ("# FIXME", "leftover"),
    "f.sh": ("cd /work/main", "path of one machine"),
    "g.json": ('{"x": "/root/y"}', "path of one machine"),
    "h.cmake": ('set(x "/home/me")', "path of one machine"),
    "package-lock.json": ('"resolved": "x"', "registry"),
    "i.npmrc": ("https://registry.example.org/npm", "registry"),
    "j.cpp": ("<<<<<<< ours", "merge conflict"),
    "axis.pb.h": ("", "generated"),
    "api/python/axis_pb2_grpc.py": ("", "generated"),
    "lib.so": ("", "generated"),
    "long.cpp": ("x\n" * 601, "601 lines"),
}

# 20 data members, and all that is none.
A_CLASS = """class Small final : public Base<int> {
 public:
  explicit Small(int a_) : one_(a_) {}
  [[nodiscard]] int one() const { return one_; }
  std::function<void(int)> handler(int first, int another_,
                                   int third_);
  enum class Kind { a_, b_ };

 private:
  struct Inner {
    int not_mine_ = 0;
  };
  static constexpr int none_ = 1;
  using Other_ = int;
  std::function<void(std::map<int, int>)> one_;  ///< not two_, nor three_;
  int two_ = 0, three_{}, four_[4], five_ = f(1);
  std::map<std::string, std::vector<int>, std::less<>>
      six_;
  std::shared_ptr<int> seven_ = std::make_shared<int>();
  int eight_, nine_, ten_, eleven_, twelve_, thirteen_, fourteen_, fifteen_;
  int sixteen_, seventeen_, eighteen_, nineteen_, twenty_;MORE
};
"""

BAD_DOCUMENTS = {  # path -> (text, what the finding says)
    "devices/m1/a.cpp": ("/// M2: whoever wrote this knows.", "M2 has no heading"),
    "tests/rules/b_test.cpp": ("TEST(M03Late, Never) {}", "M3 has no heading"),
    "docs/c.md": ("As M33 says.", "M33 has no heading"),
    "docs/d.md": ("See `devices/m1/gone.cpp`.", "there is no devices/m1/gone.cpp"),
    "docs/e.md": ("See `devices/MODEL/gone.cpp`.", "there is no devices/MODEL/gone.cpp"),
    "docs/f.md": ("See `devices/*.cpp` first.", "there is no devices/*.cpp"),
    "docs/g.md": ("See [the rules](../rules.md).", "there is no ../rules.md"),
    "README.md": ("One more line.\n" * 151, "at most 150"),
}

BAD_RULES = {  # docs/rules.md -> what the finding says
    "## M1 Nothing\n## M14 Stop\n## M15 Bounds\n": "M15 is cited by no test",
    "## M1 Nothing\n## M14 Stop\n## M14 Stop\n": "M14 has two headings",
    "## M1 Nothing\n## M14 Stop\n\n- `devices/m1/drive.cpp`:\n  `gone`\n": "gone is in none of the files",
}


def make_tree(folder, files):
    for name, text in files.items():
        path = Path(folder) / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text + ("" if text.endswith("\n") else "\n"), encoding="utf-8")


class Checks(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)
        make_tree(self.root, GOOD)

    def test_a_good_tree_passes(self):
        self.assertEqual(layering.findings(self.root), [])
        self.assertEqual(texts.findings(self.root), ([], []))
        self.assertEqual(documents.findings(self.root), [])
        self.assertEqual(members.findings(self.root), [])

    def expect_only(self, found, expected):
        """Each bad file has one finding, which says why; no other file has any."""
        self.assertEqual(sorted(line.split(":")[0] for line in found), sorted(expected))
        for name, why in expected.items():
            self.assertIn(why, next(line for line in found if line.startswith(f"{name}:")))

    def test_each_forbidden_include_is_found(self):
        make_tree(self.root, {name: text for name, (text, _) in BAD_INCLUDES.items()})
        self.expect_only(layering.findings(self.root), {name: why for name, (_, why) in BAD_INCLUDES.items()})

    def test_time_outside_the_clock_is_found(self):
        make_tree(self.root, BAD_TIME)
        self.expect_only(layering.findings(self.root), dict.fromkeys(BAD_TIME, "time goes through"))

    def test_each_forbidden_text_is_found(self):
        make_tree(self.root, {name: text for name, (text, _) in BAD_TEXTS.items()})
        failures, warnings = texts.findings(self.root)
        self.expect_only(failures, {name: why for name, (_, why) in BAD_TEXTS.items()})
        self.assertEqual(warnings, [])

    def test_what_documents_do_not_keep_is_found(self):
        make_tree(self.root, {name: text for name, (text, _) in BAD_DOCUMENTS.items()})
        self.expect_only(documents.findings(self.root), {name: why for name, (_, why) in BAD_DOCUMENTS.items()})

    def test_each_fault_of_the_rules_is_found(self):
        for rules, why in BAD_RULES.items():
            make_tree(self.root, {"docs/rules.md": rules})
            self.expect_only(documents.findings(self.root), {"docs/rules.md": why})

    def test_a_tree_without_rules_fails(self):
        (self.root / "docs/rules.md").unlink()
        found = documents.findings(self.root)
        self.assertTrue(any("M14 has no heading" in line for line in found), found)

    def test_data_members_are_counted(self):
        make_tree(self.root, {"buses/small.hpp": A_CLASS.replace("MORE", "")})
        self.assertEqual(members.findings(self.root), [])
        make_tree(self.root, {"buses/large.hpp": A_CLASS.replace("MORE", "\n  int more_;"),
                              "tests/large.hpp": A_CLASS.replace("MORE", "\n  int more_;")})
        self.expect_only(members.findings(self.root), {"buses/large.hpp": "Small has 21 data members, at most 20"})

    def test_long_files_are_warned_of(self):
        make_tree(self.root, {"longish.cpp": "x\n" * 401})
        failures, warnings = texts.findings(self.root)
        self.assertEqual(failures, [])
        self.assertEqual(len(warnings), 1)

    def test_findings_are_located_and_fail_the_command(self):
        make_tree(self.root, {"buses/deep.cpp": '// one\n// two\n#include "config/x.hpp"\n'})
        for script, bad in (("layering.py", True), ("texts.py", False)):
            done = subprocess.run([sys.executable, Path(__file__).with_name(script), self.root],
                                  capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 1 if bad else 0, done.stdout + done.stderr)
            if bad:
                self.assertIn("buses/deep.cpp:3: includes config/x.hpp", done.stdout)

    def test_ignored_files_of_a_repository_are_left_alone(self):
        subprocess.run(["git", "init", "-q", self.root], check=True)
        make_tree(self.root, {".gitignore": "/build/\n", "build/x.o": "", "buses/new.cpp": '#include "devices/x.hpp"'})
        self.assertEqual(texts.findings(self.root), ([], []))
        self.assertEqual(len(layering.findings(self.root)), 1, "files that are not added yet count")


if __name__ == "__main__":
    unittest.main()
