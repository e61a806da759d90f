// Jobs on one data folder while workers and servers are killed, frozen and terminated. Parameters:
// COLOR3D_CHAOS_JOBS, _FAULTS and _SEED. Label "chaos".
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/files.h"
#include "tests/support/service/chaos_service.h"

namespace color3d {
namespace {
using testing::ChaosSeed;
using testing::ChaosService;
using ::testing::Contains;
using testing::Fault;
using testing::FromEnvironment;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::ResultOf;
using testing::ScriptedSpec;
using testing::SleepMs;

constexpr char kScript[] = "steps=8,ms=150";  // each job takes longer than its lease of one second
constexpr int kSubmittedFirst = 20;
constexpr int kLongestWaitS = 300;

struct Budget {
  int64_t submissions = 200;
  int64_t faults = 60;
  std::vector<Fault> kinds = ChaosService::AllFaults();
};

class Submitter {
 public:
  explicit Submitter(ChaosService& service)
      : service_(service), scene_(service.client().MakeScene().name()) {}
  void Submit() {
    const int seed = static_cast<int>(names_.size()) + 1;  // distinct work for each job
    names_.push_back(service_.client().Create(ScriptedSpec(scene_, kScript, seed)).name());
  }
  const std::vector<std::string>& names() const { return names_; }

 private:
  ChaosService& service_;
  const std::string scene_;
  std::vector<std::string> names_;
};

// Returns failures, one per line.
std::vector<std::string> Endure(ChaosService& service, const Budget& budget) {
  Random random(ChaosSeed());
  const auto begun = std::chrono::steady_clock::now();
  Submitter jobs(service);
  jobs.Submit();
  service.client().WaitFinished(jobs.names()[0]);
  const std::string undisturbed = ResultOf(service.client(), jobs.names()[0]);
  const auto submitted = [&] { return static_cast<int64_t>(jobs.names().size()); };
  while (submitted() < std::min<int64_t>(kSubmittedFirst, budget.submissions)) jobs.Submit();
  while (service.faults() < budget.faults) {
    SleepMs(100 + static_cast<int>(random.NextBelow(600)));
    service.Disturb(random, budget.kinds);
    // Keeps work to disturb until the end.
    const int64_t due =
        kSubmittedFirst + (budget.submissions - kSubmittedFirst) * service.faults() / budget.faults;
    while (submitted() < std::min(due, budget.submissions)) jobs.Submit();
  }
  std::vector<std::string> problems;
  for (const std::string& name : jobs.names()) {
    try {
      service.client().WaitFinished(name, kLongestWaitS);
      const std::string result = ResultOf(service.client(), name);
      if (result != undisturbed) problems.push_back(name + " is not as undisturbed: " + result);
    } catch (const std::runtime_error& e) {
      problems.push_back(e.what());
    }
  }
  for (const std::string& problem : service.EndAndAudit()) problems.push_back(problem);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  std::cout << submitted() << " submissions, " << service.Count("select count(*) from job")
            << " jobs, " << service.faults() << " faults: " << service.Faults() << "; "
            << service.Count("select count(*) from job_attempt where outcome='LOST'")
            << " attempts lost, " << service.RepeatedSteps() << " steps begun anew, "
            << problems.size() << " problems, " << seconds << " s\n";
  return problems;
}

TEST(ChaosTest, JobsEndAsUndisturbedWithEffectsOnce) {
  const ScratchFolder scratch;
  ChaosService service(scratch.path());
  Budget budget;
  budget.submissions = FromEnvironment("COLOR3D_CHAOS_JOBS", budget.submissions);
  budget.faults = FromEnvironment("COLOR3D_CHAOS_FAULTS", budget.faults);
  EXPECT_THAT(Endure(service, budget), IsEmpty());
  EXPECT_GT(service.RepeatedSteps(), 0) << "nothing was ever taken over: the test proves nothing";
}

// Negative control: with a server that ignores the lease epoch, the same scenario must fail.
TEST(ChaosTest, EffectsAreDoubledWithoutFence) {
  const ScratchFolder scratch;
  ChaosService service(scratch.path(), {}, COLOR3D_UNFENCED_SERVER);
  const Budget budget{40, 12, {Fault::kWorkerFrozen}};
  EXPECT_THAT(Endure(service, budget), Contains(HasSubstr("effects that occur twice")));
}

}  // namespace
}  // namespace color3d
