// color3d-test-worker: the worker loop with scripted stages instead of the method library. Every
// kind writes the artifacts that its successors read. A select_key_view job with STRATEGY_MANUAL
// takes its script from `view`: words separated by commas.
//   steps=N  ms=N       N steps of the given milliseconds, a checkpoint after each
//   crash, throw, oom, unavailable_once, hang (ignores cancellation)
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <new>
#include <sstream>
#include <thread>

#include "core/base/files.h"
#include "core/catalogue/artifacts.h"
#include "core/catalogue/stages.h"
#include "server/planning/spec_check.h"
#include "server/worker/worker_loop.h"

namespace color3d {
namespace {

struct Script {
  int steps = 3;
  int step_ms = 1;
  std::vector<std::string> words;
  bool Has(const std::string& word) const {
    for (const std::string& w : words) {
      if (w == word) return true;
    }
    return false;
  }
};

Script ParseScript(const std::string& text) {
  Script script;
  std::stringstream stream(text);
  std::string word;
  while (std::getline(stream, word, ',')) {
    if (word.rfind("steps=", 0) == 0) {
      script.steps = std::atoi(word.c_str() + 6);
    } else if (word.rfind("ms=", 0) == 0) {
      script.step_ms = std::atoi(word.c_str() + 3);
    } else {
      script.words.push_back(word);
    }
  }
  return script;
}

// Artifacts of this stage that other stages read; a folder gets two files.
std::vector<std::string> ArtifactsOf(const std::string& kind) {
  const Stage& stage = StageOf(kind);
  if (stage.outputs.empty()) return {};
  const std::string name = stage.outputs.front();
  if (!name.ends_with('/')) return {name};
  return {name + "a.png", name + "b.png"};
}

// Tests count effects in shared files: a line in "<prefix>.begun" at the start of a step, which
// repeats after a lost attempt, and one in "<prefix>.saved" after the fenced write, which must not
// repeat.
void LogEffect(const char* file, const std::string& job, int step) {
  const char* prefix = std::getenv("COLOR3D_TEST_EFFECTS");
  if (prefix == nullptr) return;
  const std::string line = job + " " + std::to_string(step) + "\n";
  std::ofstream(std::string(prefix) + file, std::ios::app) << line;
}

class ScriptedRunner : public StageRunner {
 public:
  StageOutput Run(const StageRun& run,
                  BlobSource& blobs,
                  CheckpointStore& checkpoints,
                  ProgressObserver& progress,
                  const CancellationToken& cancel) override;

 private:
  static void Misbehave(const Script& script, CheckpointStore& checkpoints);
};

void ScriptedRunner::Misbehave(const Script& script, CheckpointStore& checkpoints) {
  if (script.Has("crash")) std::abort();
  if (script.Has("throw")) throw InvalidArgument("scripted failure");
  if (script.Has("oom")) throw std::bad_alloc();
  if (script.Has("unavailable_once") && !checkpoints.Load()) {
    checkpoints.Save("tried");
    throw Error(ErrorCode::kUnavailable, "scripted outage");
  }
  while (script.Has("hang")) std::this_thread::sleep_for(std::chrono::milliseconds(20));
}

StageOutput ScriptedRunner::Run(const StageRun& run,
                                BlobSource& blobs,
                                CheckpointStore& checkpoints,
                                ProgressObserver& progress,
                                const CancellationToken& cancel) {
  const std::string kind = KindOf(run.spec);
  for (const FileDigest& digest : SpecBlobs(run.spec)) ReadFile(blobs.Fetch(digest.sha256));
  const Script script = ParseScript(run.spec.select_key_view().view());
  Misbehave(script, checkpoints);
  // The state has a line for each step with its process. Each Save is fenced, so the published
  // trace has every step once, whatever is killed in between.
  std::string trace = checkpoints.Load().value_or("");
  int step = static_cast<int>(std::count(trace.begin(), trace.end(), '\n'));
  for (; step < script.steps; ++step) {
    cancel.ThrowIfCancelled();
    LogEffect(".begun", run.job_name, step);
    std::this_thread::sleep_for(std::chrono::milliseconds(script.step_ms));
    trace += std::to_string(step) + " " + std::to_string(::getpid()) + "\n";
    if (checkpoints.WantsSave()) {
      checkpoints.Save(trace);
      LogEffect(".saved", run.job_name, step);
    }
    progress.OnProgress(step + 1, script.steps, kind);
    progress.OnError(step, "train_l1", 1.0 / (step + 1));
  }
  StageOutput output;
  output.files = ArtifactsOf(kind);
  for (const std::string& name : output.files) {
    std::filesystem::create_directories((run.output_folder / name).parent_path());
    // Colorizers of different scenes differ.
    const std::string own = kind == kind::kPersonalize ? run.job_name : "";
    WriteFileAtomic(run.output_folder / name, kind + " " + name + own + "\n" + trace);
  }
  if (run.inputs.contains(artifact::kPly)) output.passed_on.push_back(artifact::kPly);
  return output;
}

// Answers "<colorizer> <picture>" in place of a PNG. A picture may contain one of the words
//   crash, hang (forever), slow (200 ms), damaged, big (answer of 1 MiB)
class ScriptedEngine : public LiveEngine {
 public:
  void WarmUp() override {}
  void Colorize(std::vector<LiveTask>& tasks) override {
    for (LiveTask& task : tasks) {
      try {
        Answer(*task.request, task.response);
      } catch (const std::exception&) {
        task.error = std::current_exception();
      }
    }
  }

 private:
  static void Answer(const internal::v1::ColorizeImageRequest& request,
                     internal::v1::ColorizeImageResponse* response) {
    const std::string& picture = request.image();
    const auto has = [&](const char* word) { return picture.find(word) != std::string::npos; };
    if (has("crash")) std::abort();
    while (has("hang")) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    if (has("slow")) std::this_thread::sleep_for(std::chrono::milliseconds(200));
    if (has("damaged")) throw InvalidArgument("the picture is truncated");
    response->set_image(request.colorizer_sha256() + request.example_sha256() + " " + picture);
    if (has("big")) response->mutable_image()->append(1 << 20, '.');
    response->set_encoder_digest("scripted " + request.encoder());
  }
};

std::unique_ptr<LiveEngine> MakeScriptedEngine(const LiveEngineSetup&) {
  return std::make_unique<ScriptedEngine>();
}

std::unique_ptr<StageRunner> MakeScriptedRunner() { return std::make_unique<ScriptedRunner>(); }

}  // namespace
}  // namespace color3d

int main(int argc, char** argv) {
  return color3d::WorkerMain(
      argc, argv, {&color3d::MakeScriptedRunner, &color3d::MakeScriptedEngine});
}
