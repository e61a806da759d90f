#include "server/ops/scale_command.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <mutex>
#include <sstream>

#include "core/base/error.h"
#include "core/base/files.h"
#include "server/ops/process_state.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Keeps what is logged.
class TextSink : public spdlog::sinks::base_sink<std::mutex> {
 public:
  std::string text() {
    const std::lock_guard lock(mutex_);
    return text_;
  }

 private:
  void sink_it_(const spdlog::details::log_msg& line) override {
    text_ += std::string(spdlog::level::to_string_view(line.level).data()) + " " +
             std::string(line.payload.data(), line.payload.size()) + "\n";
  }
  void flush_() override {}
  std::string text_;
};

class ScaleCommandTest : public ::testing::Test {
 protected:
  ScaleCommandTest() : usual_log_(spdlog::default_logger()) {
    spdlog::set_default_logger(std::make_shared<spdlog::logger>("test", log_));
    options_.output = scratch_.path() / "output";
    options_.poll = milliseconds(10);
    options_.pause = milliseconds(10);
  }
  ~ScaleCommandTest() override { spdlog::set_default_logger(usual_log_); }

  // A script that notes its arguments, one run a line, and continues with `rest`.
  void Write(const std::string& rest, const std::string& name = "scale") {
    options_.program = scratch_.path() / name;
    WriteFileAtomic(options_.program,
                    "#!/bin/sh\necho \"$#:$*\" >> '" + (scratch_.path() / "runs").string() + "'\n" +
                        rest + "\n");
    fs::permissions(options_.program, fs::perms::owner_all);
  }
  void Start() {
    command_.emplace(options_, [this]() -> std::optional<int64_t> {
      const int64_t demand = demand_;
      if (demand == kBroken) throw Error(ErrorCode::kUnavailable, "the store is away");
      return demand == kElsewhere ? std::nullopt : std::optional(demand);
    });
  }
  std::vector<std::string> Runs() const {
    std::vector<std::string> lines;
    if (!fs::exists(scratch_.path() / "runs")) return lines;
    std::istringstream file(ReadFile(scratch_.path() / "runs"));
    for (std::string line; std::getline(file, line);) lines.push_back(line);
    return lines;
  }
  static bool Becomes(const std::function<bool()>& condition) {
    for (int i = 0; i < 3000 && !condition(); ++i) std::this_thread::sleep_for(milliseconds(10));
    return condition();
  }
  bool Ran(size_t times) {
    return Becomes([&] { return Runs().size() >= times; });
  }
  bool Logs(const std::string& part) {
    return Becomes([&] { return log_->text().find(part) != std::string::npos; });
  }
  // Ends the thread first.
  std::string Log() {
    command_.reset();
    return log_->text();
  }
  static int Count(const std::string& text, const std::string& part) {
    int count = 0;
    for (size_t at = 0; (at = text.find(part, at)) != std::string::npos; ++at) ++count;
    return count;
  }

  static constexpr int64_t kElsewhere = -1, kBroken = -2;
  ScratchFolder scratch_;
  const std::shared_ptr<TextSink> log_ = std::make_shared<TextSink>();
  std::shared_ptr<spdlog::logger> usual_log_;
  ScaleCommandOptions options_;
  std::atomic<int64_t> demand_{0};
  std::optional<ScaleCommand> command_;
};

TEST_F(ScaleCommandTest, TellsEachNumberOnceAndCutsIt) {
  Write("");
  options_.max_workers = 5;
  Start();
  ASSERT_TRUE(Ran(1));
  int runs = 1;
  for (const int64_t demand : {3, 1000, 0}) {
    demand_ = demand;
    ASSERT_TRUE(Ran(++runs));
  }
  demand_ = kElsewhere;
  std::this_thread::sleep_for(milliseconds(200));
  EXPECT_THAT(Runs(), ElementsAre("1:0", "1:3", "1:5", "1:0"));
  demand_ = 0;  // this server's turn again
  EXPECT_TRUE(Ran(5));
  EXPECT_THAT(Log(), HasSubstr("was told that 5 workers are wanted"));
}

TEST_F(ScaleCommandTest, WaitsBetweenRuns) {
  Write("");
  options_.pause = seconds(600);
  Start();
  ASSERT_TRUE(Ran(1));
  for (int i = 1; i < 20; ++i) {
    demand_ = i;
    std::this_thread::sleep_for(milliseconds(10));
  }
  EXPECT_EQ(Runs().size(), 1u);
}

// An engine ends workers at the end of their time.
TEST_F(ScaleCommandTest, RepeatsNumberAboveZero) {
  Write("");
  options_.repeat = milliseconds(30);
  Start();
  ASSERT_TRUE(Ran(1));
  std::this_thread::sleep_for(milliseconds(200));
  EXPECT_EQ(Runs().size(), 1u) << "0 is not repeated";
  demand_ = 2;
  ASSERT_TRUE(Ran(4));
  EXPECT_EQ(Runs().back(), "1:2");
  EXPECT_EQ(Count(Log(), "2 workers are wanted"), 1);
}

TEST_F(ScaleCommandTest, LogsFailureOnceAndTriesAgainLessOften) {
  Write("echo 'Invalid account' >&2\ntest -e '" + (scratch_.path() / "works").string() + "'");
  options_.pause = milliseconds(20);
  options_.max_backoff = milliseconds(160);
  demand_ = 4;
  const auto start = std::chrono::steady_clock::now();
  Start();
  ASSERT_TRUE(Ran(6));
  EXPECT_GE(std::chrono::steady_clock::now() - start, milliseconds(20 + 40 + 80 + 160 + 160));
  WriteFileAtomic(scratch_.path() / "works", "");
  ASSERT_TRUE(Ran(7));
  std::this_thread::sleep_for(milliseconds(500));
  EXPECT_EQ(Runs().size(), 7u) << "told once it worked";
  const std::string log = Log();
  EXPECT_EQ(Count(log, "error"), 1) << log;
  EXPECT_THAT(
      log, HasSubstr("exit status 1; run it by hand as this user (it printed: Invalid account;"));
  EXPECT_THAT(log, HasSubstr("4 workers are wanted"));
}

TEST_F(ScaleCommandTest, KillsCommandThatHangsWithItsChildren) {
  const fs::path child = scratch_.path() / "child";
  Write("sleep 1000 & echo $! > '" + child.string() + "'; echo waiting; wait");
  options_.time_limit = seconds(1);
  options_.pause = seconds(600);
  demand_ = 1;
  Start();
  ASSERT_TRUE(Becomes([&] { return fs::exists(child) && !ReadFile(child).empty(); }));
  const pid_t pid = std::stoi(ReadFile(child));
  EXPECT_TRUE(IsRunning(pid));
  EXPECT_TRUE(Becomes([&] { return !IsRunning(pid); }));
  EXPECT_TRUE(Logs("error"));
  const std::string log = Log();
  EXPECT_THAT(log, HasSubstr("did not end within 1 s and was killed"));
  EXPECT_THAT(log, HasSubstr("it printed: waiting"));
}

TEST_F(ScaleCommandTest, EndKillsRunningCommandAtOnce) {
  const fs::path child = scratch_.path() / "child";
  Write("trap '' TERM; sleep 1000 & echo $! > '" + child.string() + "'; wait");
  Start();
  ASSERT_TRUE(Becomes([&] { return fs::exists(child) && !ReadFile(child).empty(); }));
  const pid_t pid = std::stoi(ReadFile(child));
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(Log(), "") << "no failure";
  EXPECT_LT(std::chrono::steady_clock::now() - start, seconds(5));
  EXPECT_TRUE(Becomes([&] { return !IsRunning(pid); }));
}

TEST_F(ScaleCommandTest, NoShellReadsTheProgram) {
  ::setenv("COLOR3D_TOKEN", "secret", 1);
  Write("env", "a b; touch injected $(touch injected)");
  demand_ = 2;
  Start();
  ASSERT_TRUE(Ran(1));
  command_.reset();
  ::unsetenv("COLOR3D_TOKEN");
  EXPECT_THAT(Runs(), ElementsAre("1:2"));
  EXPECT_FALSE(fs::exists("injected"));
  EXPECT_EQ(ReadFile(options_.output).find("secret"), std::string::npos);
}

TEST_F(ScaleCommandTest, SaysWhatIsWrongWithAProgram) {
  // Without an interpreter.
  options_.program = scratch_.path() / "scale";
  WriteFileAtomic(options_.program, "echo begun\n");
  fs::permissions(options_.program, fs::perms::owner_all);
  options_.pause = seconds(600);
  Start();
  EXPECT_TRUE(Logs("must begin with its interpreter"));
  command_.reset();
  // A tool that is not on the PATH.
  Write("color3d-no-such-tool");
  Start();
  EXPECT_TRUE(Logs("a program that it names is missing"));
  command_.reset();
  // Removed while the server runs.
  fs::remove(options_.program);
  options_.pause = milliseconds(10);
  Start();
  EXPECT_TRUE(Logs("it must be a file that this user may execute"));
}

TEST_F(ScaleCommandTest, WaitsWhileTheDemandIsUnknown) {
  Write("");
  demand_ = kBroken;
  Start();
  EXPECT_TRUE(Logs("the store is away"));
  std::this_thread::sleep_for(milliseconds(200));
  demand_ = 1;
  ASSERT_TRUE(Ran(1));
  const std::string log = Log();
  EXPECT_EQ(Count(log, "the store is away"), 1) << log;
}

TEST_F(ScaleCommandTest, LongOutputIsCut) {
  Write("i=0; while [ $i -lt 2000 ]; do printf 'long \\033[31m'; i=$((i+1)); done; exit 1");
  options_.pause = seconds(600);
  Start();
  EXPECT_TRUE(Logs("error"));
  const std::string log = Log();
  EXPECT_THAT(log, HasSubstr("\\x1b"));
  EXPECT_EQ(log.find('\033'), std::string::npos);
  EXPECT_LT(log.size(), 2000u);
}

TEST(CheckScaleCommandTest, RefusesWhatCannotRun) {
  ScratchFolder scratch;
  const auto refusal = [](const fs::path& program) -> std::string {
    try {
      CheckScaleCommand(program);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_THAT(refusal("scale"), HasSubstr("give the absolute path"));
  EXPECT_THAT(refusal(""), HasSubstr("give the absolute path"));
  EXPECT_THAT(refusal(scratch.path()), HasSubstr("must be a file that this user may execute"));
  EXPECT_THAT(refusal(scratch.path() / "none"), HasSubstr("chmod +x"));
  EXPECT_EQ(refusal("/bin/true"), "");
}

}  // namespace
}  // namespace color3d
