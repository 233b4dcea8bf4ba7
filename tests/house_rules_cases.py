# SPDX-License-Identifier: MIT
# Violations for house_rules.py --self-test, one per tree, and correct code that it must accept.
import os

CPP = "// SPDX-License-Identifier: MIT\n"
HPP = CPP + "// A header with its purpose.\n#pragma once\n"
SH = "#!/bin/sh\n# SPDX-License-Identifier: MIT\n"
CMAKE = "# SPDX-License-Identifier: MIT\n"
TASK = CPP + "awaitable<void> task() {\n"

# path, content, expected message
BREACHES = [
    ("daemon/a.cpp", CPP + "std::ifstream in(path);\n", ":2: std::ifstream also opens pipes"),
    ("tools/a.cpp", CPP + 'FILE* f = std::fopen(path, "r");\n', "also opens pipes"),
    ("tools/a.cpp", CPP + "auto text = json.dump();\n", ":2: dump() throws"),
    ("tools/a.cpp", CPP + 'bool no_log = error.what.find("no log is written") != npos;\n', ":2: decides by the text"),
    ("tools/a.cpp", CPP + 'refused_ = answer.error().text().starts_with("rows");\n', ":2: decides by the text"),
    ("base/a.cpp", CPP + '#include "compensation/sample.hpp"\n', ":2: base may not include compensation"),
    ("compensation/a.cpp", CPP + '#include "base/file.hpp"\n', "which can block"),
    ("compensation/a.cpp", CPP + '#include "drivers/clock.hpp"\n', ":2: compensation may not include drivers"),
    ("compensation/a.cpp", CPP + '#include "compensation/training/fit.hpp"\n', "may not include compensation/training"),
    ("compensation/a.cpp", CPP + "#include <thread>\n", "may not include <thread>"),
    ("compensation/a.cpp", CPP + "#include <fstream>\n", "may not include <fstream>"),
    ("compensation/a.cpp", CPP + "#include <boost/math/tools.hpp>\n", "may not include <boost/math/tools.hpp>"),
    ("compensation/a.cpp", CPP + "#include <spdlog/spdlog.h>\n", "may not include <spdlog/spdlog.h>"),
    ("compensation/compensation_engine.cpp", CPP + "#include <nlohmann/json.hpp>\n", "only JSON readers"),
    ("compensation/a.cpp", CPP + "auto t = std::chrono::steady_clock::now();\n", ":2: compensation may not read the clock"),
    ("compensation/a.cpp", CPP + "auto t = std::time(nullptr);\n", "may not read the clock"),
    ("tools/prismcal/report/a.cpp", CPP + "int f() {\n  return system(name.c_str());\n}\n", ":3: tools/prismcal/report/a.cpp may not start a program"),
    ("tools/a.cpp", CPP + "auto* pipe = ::popen(command.c_str(), mode);\n", "may not start a program (popen("),
    ("base/a.cpp", CPP + "std::system(name.c_str());\n", "may not start a program"),
    ("daemon/a.cpp", CPP + "::execlp(name, name, nullptr);\n", "may not start a program (execlp("),
    ("config/a.cpp", CPP + "posix_spawnp(&child, name, nullptr, nullptr, arguments, environ);\n", "may not start a program (posix_spawnp("),
    ("drivers/a.cpp", CPP + "#include <spawn.h>\n", "may not start a program (<spawn.h>"),
    ("tools/a.cpp", CPP + 'const char* shell = "/bin/sh";\n', "may not start a program (/bin/sh"),
    ("daemon/a.cpp", CPP + "bool b = fs::exists(name(path));\n", ":2: exists without an error_code throws"),
    ("config/a.cpp", CPP + "std::error_code error;\nauto a = std::filesystem::absolute(path);\n", ":3: absolute without"),
    ("daemon/pipeline/a.cpp", CPP + "std::error_code e;\nfor (const auto& x : fs::directory_iterator(p, e)) {\n}\n", ":3: a range-for"),
    ("compensation/training/a.cpp", CPP + "#include <boost/asio/io_context.hpp>\n", "may not include <boost/asio"),
    ("compensation/training/a.cpp", CPP + "#include <fstream>\n", "may not include <fstream>"),
    ("compensation/evaluation/a.cpp", CPP + "#include <thread>\n", "may not include <thread>"),
    ("compensation/evaluation/a.cpp", CPP + '#include "compensation/training/a.hpp"\n', "may not include"),
    ("drivers/wire/decode/a.cpp", CPP + "#include <boost/asio/post.hpp>\n", "drivers/wire/decode may not include <boost/asio"),
    ("drivers/wire/encode/a.cpp", CPP + "#include <boost/math/tools.hpp>\n", "drivers/wire/encode may not include <boost/math"),
    ("drivers/wire/decode/a.cpp", CPP + '#include "drivers/clock.hpp"\n', "drivers/wire/decode may not include drivers "),
    ("drivers/wire/description/a.cpp", CPP + '#include "drivers/wire/decode/a.hpp"\n', "may not include drivers/wire/decode"),
    ("drivers/wire/decode/a.cpp", CPP + '#include "drivers/wire/encode/a.hpp"\n', "may not include drivers/wire/encode"),
    ("drivers/wire/encode/a.cpp", CPP + '#include "drivers/wire/decode/a.hpp"\n', "may not include drivers/wire/decode"),
    ("drivers/wire/a.cpp", CPP + "#include <string>\n", "drivers/wire may not include <string>"),
    ("drivers/a.cpp", CPP + '#include "compensation/compensation_engine.hpp"\n', "drivers may not include compensation"),
    ("drivers/a.cpp", CPP + '#include "config/config.hpp"\n', "drivers may not include config"),
    ("drivers/a.cpp", CPP + "#include <spdlog/spdlog.h>\n", "may not include <spdlog/spdlog.h>"),
    ("config/a.cpp", CPP + '#include "daemon/live.hpp"\n', "config may not include daemon"),
    ("daemon/a.cpp", CPP + '#include "compensation/training/fit.hpp"\n', "daemon may not include compensation/training"),
    ("daemon/a.cpp", CPP + '#include "compensation/evaluation/allan.hpp"\n', "may not include compensation/evaluation"),
    ("daemon/a.cpp", CPP + '#include "tools/a.hpp"\n', "daemon may not include tools"),
    ("tools/a.cpp", CPP + '#include "daemon/live.hpp"\n', "tools may not include daemon"),
    ("daemon/socket/a.cpp", CPP + '#include "daemon/log/row_log.hpp"\n', "daemon/socket may not include daemon/log"),
    ("daemon/line/a.cpp", CPP + '#include "daemon/live.hpp"\n', "daemon/line may not include daemon"),
    ("daemon/pipeline/a.cpp", CPP + '#include "base/host_time.hpp"\n', "which reads the clock"),
    ("tools/a.cpp", CPP + '#include "../config/config.hpp"\n', "not relative to the root"),
    ("tools/a.cpp", CPP + '#include "connection.hpp"\n', "not relative to the root"),
    ("tools/a.cpp", CPP + "// see base/gone.hpp\n", ":2: cites base/gone.hpp"),
    ("docs/b.md", "see [page](gone.md)\n", ":1: cites gone.md"),
    ("docs/b.md", '# Title\nsee b.md, "Other"\n', ':2: cites "Other"'),
    ("tools/a.cpp", CPP + "// kNone is the limit\n", ":2: cites kNone"),
    ("tools/a.cpp", CPP + "// stop with halt()\n", ":2: cites halt()"),
    ("tools/a.cpp", CPP + "// kShare = 0.3 of all\nconstexpr double kShare = 0.25;\n", ":2: cites kShare as 0.3"),
    ("daemon/CMakeLists.txt", CMAKE + "prism_room(d\n  LINK prism_config prism_training)\n", ":3: daemon may not link prism_training"),
    ("compensation/CMakeLists.txt", CMAKE + "prism_room(c LINK prism_boost)\n", "compensation may not link prism_boost"),
    ("drivers/wire/CMakeLists.txt", CMAKE + "prism_room(w LINK prism_compensation)\n", "may not link prism_compensation"),
    ("tools/a/CMakeLists.txt", CMAKE + "target_link_libraries(a PRIVATE prism_daemon)\n", "tools may not link prism_daemon"),
    ("daemon/a.cpp", "// What it is for.\n" + CPP, ":1: expected the line '// SPDX"),
    ("daemon/a.cpp", "", ":1: expected the line '// SPDX"),
    ("daemon/CMakeLists.txt", "# The module.\n", "expected the line '# SPDX"),
    ("tools/cmake/A.cmake", "set(a 1)\n", "expected the line '# SPDX"),
    ("tools/a.py", "# About.\n", "expected the line '# SPDX"),
    ("tools/a", "#!/bin/sh\necho\n", ":2: expected the line '# SPDX"),
    ("daemon/a.hpp", CPP + "#pragma once\n", ":2: expected one line with the purpose of the header"),
    ("daemon/a.hpp", CPP, ":2: expected one line"),
    ("daemon/a.cpp", CPP + "// TO" + "DO: later\n", ":2: 'TO" + "DO' belongs in an issue"),
    ("tools/a.py", "# SPDX-License-Identifier: MIT\n# FIX" + "ME\n", "belongs in an issue"),
    ("daemon/a.cpp", CPP + "using namespace std;\n", "'using namespace std'"),
    ("daemon/a.cpp", CPP + "using  namespace  std::chrono_literals;\n", "'using namespace std'"),
    ("tests/system/010-a.sh", CMAKE + "trap 'umount x; cleanup' EXIT\n", ":2: a trap hides the exit code"),
    ("tests/system/010-a.sh", CMAKE + "prismcal report a | awk '/x/ {print; exit}'\n", ":2: the reader of this pipe leaves early"),
    ("daemon/a.cpp", TASK + "  co_await write(Frame{1, 2});\n}\n", ":3: a brace in the statement of a co_await"),
    ("daemon/a.cpp", TASK + "  co_await write(\n    {1, 2});\n}\n", ":3: a brace"),
    ("daemon/a.cpp", TASK + "  Row row{co_await read()};\n}\n", ":3: a brace"),
    ("daemon/a.cpp", TASK + "  if (co_await write({1})) return;\n}\n", ":3: a brace"),
    ("daemon/a.cpp", TASK + "  auto x = std::string{\"a\"} + co_await read();\n}\n", ":3: a brace"),
    ("daemon/a.cpp", TASK + "  co_await run([this] { stop(); });\n}\n", ":3: a capturing lambda"),
    ("daemon/a.cpp", TASK + "  co_await run([&](int n) { stop(n); });\n}\n", ":3: a capturing lambda"),
    ("daemon/a.cpp", TASK + "  use(co_await a(), co_await b());\n}\n", ":3: a second co_await"),
    ("daemon/a.cpp", CPP + "namespace prism {\n}\n", ":2: opens namespace prism, expected prism::daemon"),
    ("drivers/wire/decode/a.cpp", CPP + "namespace prism::decode {\n}\n", "expected prism::wire"),
    ("compensation/a.hpp", HPP + "namespace prism::wire {\n}\n", "expected prism::compensation"),
    ("base/result.hpp", HPP + "namespace prism::compensation {\n}\n", "expected prism"),
    ("tools/prismcal/main.cpp", CPP + "namespace prism::prismcal {\n}\n", "expected prism::commands"),
    ("daemon/a.hpp", HPP + "struct Loose {\n};\n", ":4: Loose is not in a namespace, expected prism::daemon"),
    ("docs/architecture.md", "### The path of a frame\n|drivers/gone||step|\n", ":2: lists drivers/gone, which contains no code"),
]

# Pairs of files with the same type; the message must be about the second file.
TWICE = [
    (("drivers/a.hpp", HPP + "namespace prism::drivers {\nstruct Row {\n};\n}\n"),
     ("drivers/b.cpp", CPP + "namespace prism::drivers {\nclass [[nodiscard]] Row final : public Base<int> {};\n}\n")),
    (("tools/prismctl/a.cpp", CPP + "namespace prism::prismctl {\nenum class Form : int { kA };\n}\n"),
     ("tools/prismctl/b.cpp", CPP + "namespace prism::prismctl {\nvoid f() { if (x) { y(); } }\nunion Form { int a; };\n}\n")),
    (("compensation/sample.hpp", HPP + "namespace prism {\n#define LINE {\nstruct Row {};\n}\n"),
     ("base/result.hpp", HPP + "namespace prism {\ntemplate <class T>\nstruct Row {};\n}\n")),
]

# Code, and a page whose table "The path of a frame" differs from it.
PATH = [
    ("|drivers/a.cpp|`log_->append(`|step|", ":2: lists the call log_->append(…), which drivers/a.cpp does not contain"),
    ("|drivers/a.cpp|`clock_.push(`|step|", ":2: lists the call clock_.push(…), but no file of the table contains the function"),
]

# No messages are expected for these. tools/a is made executable.
SOUND = [
    ("daemon/walks.cpp", CPP + "std::error_code e;\nfor (fs::directory_iterator entry(p, e), end; !e && entry != end; entry.increment(e)) {\n}\n"),
    ("compensation/model_text.cpp", CPP + '#include <nlohmann/json.hpp>\n#include "compensation/model.hpp"\n'),
    ("compensation/a.cpp", CPP + "// no steady_clock::now() here, and no <thread>\nconst char* text = \"std::time(x)\";\n"),
    ("compensation/training/a.cpp", CPP + "#include <thread>\n#include <boost/math/distributions/fisher_f.hpp>\n"),
    ("drivers/wire/decode/a.cpp", CPP + '#include "compensation/sample.hpp"\n#include "drivers/wire/description/field.hpp"\n'),
    ("compensation/training/b.cpp", CPP + "SparseSystem system(samples);\nbool b = file.system(1);\n// system(x) and popen(x)\n"),
    ("drivers/a.cpp", CPP + '#include <boost/asio/post.hpp>\n#include "base/result.hpp"\n'),
    ("daemon/a.cpp", CPP + '#include <thread>\n#include "config/config.hpp"\n#include "compensation/compensation_engine.hpp"\n'),
    ("tools/a.js", '// kShare = 0.25 of b.py; see share() and docs/titles.md, "Title"\nconst kShare = 0.25;\nfunction share() {}\n'),
    ("tools/b.py", SH + "# as in tools/a.js\n"),
    ("docs/titles.md", "# Title\n"),
    ("tools/a.hpp", HPP + '#include "compensation/evaluation/allan.hpp"\n#include "config/version.hpp"\n'),
    ("tests/unit/a_test.cpp", CPP + '#include "daemon/live.hpp"\n#include "tools/a.hpp"\n'),
    ("daemon/CMakeLists.txt", CMAKE + "# not prism_training\nprism_room(d LINK prism_config prism_boost)\nadd_test(prism_training)\n"),
    ("tools/a", SH + "echo\n"),
    ("docs/a.md", "no SPDX line, and a word like TO" + "DO\n"),
    ("build/dev/a.cpp", "generated\n"),
    ("daemon/one.hpp", HPP + """namespace prism::daemon {
struct Row { struct Part { int n; }; enum { kA }; };
class Later;
template <> struct Of<int> {};
Row make(struct Options options) { struct Local {}; return {}; }
namespace {
struct Hidden {};
}
}  // namespace prism::daemon
namespace boost::asio { class io_context; }
"""),
    ("daemon/two.cpp", CPP + """namespace prism::daemon {
class Later {};
template <> struct Of<long> {};
namespace { struct Hidden {}; struct Row {}; }
struct Station::Row { struct Part {}; };
void f() { struct Local {}; }
}
"""),
    ("daemon/b.cpp", TASK + """  // co_await write({1});
  for (;;) {
    auto [error, size] = co_await socket.async_read_some(buffer, kUse);
    if (error) { close(); }
    const Row row{size, 1};
    if (co_await ready()) {
      items[size] = co_await take(row.next()[0]);
    } else { co_await pause(); }
    while (!co_await done()) { step(); }
    if (flag) co_await once();
    co_await (read() || stop());
    try { co_await last(); } catch (const Error& e) { told = {e}; }
  }
}
auto lambda = [this]() -> awaitable<void> { co_await run(); };
"""),
]


def plant(rules, folder, path, content):
    full = os.path.join(folder, path)
    os.makedirs(os.path.dirname(full), exist_ok=True)
    with open(full, "w", encoding="utf-8") as file:
        file.write(content)
    os.chmod(full, 0o755 if content.startswith("#!") else 0o644)
    return full


def run(rules, tempfile):
    failures = []
    for path, content, expected in BREACHES:
        with tempfile.TemporaryDirectory() as folder:
            plant(rules, folder, path, content)
            found = list(rules.breaches(folder))
            if len(found) != 1 or expected not in found[0] or not found[0].startswith(path + ":"):
                failures.append(f"{path}: expected one '{expected}', found {found}\n{content[:200]}")
    with tempfile.TemporaryDirectory() as folder:
        for path, content in SOUND:
            plant(rules, folder, path, content)
        failures += [f"correct code was rejected: {line}" for line in rules.breaches(folder)]
    for pair in TWICE:
        with tempfile.TemporaryDirectory() as folder:
            for path, content in pair:
                plant(rules, folder, path, content)
            found = list(rules.breaches(folder))
            if len(found) != 1 or "a second type" not in found[0]:
                failures.append(f"{pair[1][0]}: expected one second type, found {found}")
    for row, expected in PATH:
        with tempfile.TemporaryDirectory() as folder:
            plant(rules, folder, "drivers/a.cpp", CPP + "clock_.push(reading);\n")
            plant(rules, folder, "docs/architecture.md", "### The path of a frame\n" + row + "\n")
            found = list(rules.breaches(folder))
            if len(found) != 1 or expected not in found[0]:
                failures.append(f"{row}: expected one '{expected}', found {found}")
    for mode, path, content in ((0o644, "tools/a", SH), (0o755, "tools/a.cpp", CPP), (0o644, "tests/system/1.sh", SH)):
        with tempfile.TemporaryDirectory() as folder:
            os.chmod(plant(rules, folder, path, content), mode)
            if len(list(rules.breaches(folder))) != 1:
                failures.append(f"mode {mode:o} of {path} was not found")
    for failure in failures:
        print(failure)
    print(f"code rules, self-test: {len(failures)} failures in {len(BREACHES) + len(TWICE) + len(PATH)} violations and {len(SOUND)} correct files")
    return 1 if failures else 0
