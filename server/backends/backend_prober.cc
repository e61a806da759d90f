#include "server/backends/backend_prober.h"

#include <grpcpp/grpcpp.h>

#include <vector>

#include "color3d/backend/v1/backend.grpc.pb.h"
#include "server/backends/backend_address.h"
#include "server/backends/backend_call.h"
#include "server/backends/backend_info.h"

namespace color3d {
namespace {

constexpr int kMaxInfoBytes = 64 << 10;

// A pending GetInfo call.
struct Question {
  std::string name;
  std::unique_ptr<backend::v1::ColorBackend::Stub> stub;
  grpc::ClientContext context;
  backend::v1::BackendInfo info;
  grpc::Status status;
  std::unique_ptr<grpc::ClientAsyncResponseReader<backend::v1::BackendInfo>> reader;
};

ProbeAnswer ToProbeAnswer(const Question& question) {
  ProbeAnswer answer;
  if (!question.status.ok()) {
    answer.problem = question.status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED
                         ? "it does not answer"
                         : "GetInfo failed: " + question.status.error_message();
    return answer;
  }
  answer.reachable = true;
  answer.ready = question.info.ready();
  answer.info = InfoFromProto(question.info);
  if (!answer.ready) answer.problem = "it is loading its model";
  return answer;
}

}  // namespace

BackendProber::BackendProber(const std::map<std::string, std::string>& backends,
                             std::chrono::milliseconds deadline,
                             std::chrono::milliseconds keep)
    : deadline_(deadline), keep_(keep) {
  for (const auto& [name, address] : backends) {
    channels_[name] = OpenBackend(ParseBackendAddress(name, address), kMaxInfoBytes);
  }
}

BackendProber::~BackendProber() = default;

std::map<std::string, ProbeAnswer> BackendProber::Probe() {
  const MutexLock lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  if (!answers_.empty() && now - asked_ < keep_) return answers_;
  grpc::CompletionQueue queue;
  std::vector<std::unique_ptr<Question>> questions;
  for (const auto& [name, channel] : channels_) {
    auto question = std::make_unique<Question>();
    question->name = name;
    question->stub = backend::v1::ColorBackend::NewStub(channel);
    question->context.set_deadline(std::chrono::system_clock::now() + deadline_);
    question->reader =
        question->stub->AsyncGetInfo(&question->context, backend::v1::GetInfoRequest(), &queue);
    question->reader->Finish(&question->info, &question->status, question.get());
    questions.push_back(std::move(question));
  }
  answers_.clear();
  for (size_t done = 0; done < questions.size(); ++done) {
    void* tag = nullptr;
    bool ok = false;
    if (!queue.Next(&tag, &ok)) break;
    const auto* question = static_cast<const Question*>(tag);
    answers_[question->name] = ToProbeAnswer(*question);
  }
  queue.Shutdown();
  asked_ = std::chrono::steady_clock::now();
  return answers_;
}

}  // namespace color3d
