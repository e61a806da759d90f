#include "server/rpc/workers/worker_service.h"

#include <algorithm>
#include <cctype>
#include <map>

#include "color3d/internal/v1/worker.grpc.pb.h"
#include "core/base/text/utf8.h"
#include "server/base/service_error.h"
#include "server/rpc/blobs/blob_streams.h"
#include "server/rpc/calls/convert.h"

namespace color3d {
namespace {
namespace wire = internal::v1;
using google::bytestream::QueryWriteStatusRequest;
using google::bytestream::QueryWriteStatusResponse;
using google::bytestream::ReadRequest;
using google::bytestream::ReadResponse;
using google::bytestream::WriteRequest;
using google::bytestream::WriteResponse;
using grpc::CallbackServerContext;
using grpc::ServerUnaryReactor;

// Owner of the workers' calls, streams and uploads: not a name of a project.
constexpr char kOwner[] = "-workers";
// Of a text that a worker tells about itself.
constexpr size_t kMaxFactBytes = 100;

struct WorkerCaller {
  std::string name;  // of the token or certificate; empty: none
};

void AddJobs(const std::vector<JobRecord>& jobs, wire::Jobs* response) {
  for (const JobRecord& job : jobs) *response->add_jobs() = ToWire(job);
}

class WorkerServiceImpl final : public wire::WorkerService::CallbackService {
 public:
  WorkerServiceImpl(const RpcParts& parts, WorkerPlace place, CallMemory& memory)
      : parts_(parts), store_(parts.workers), place_(place), memory_(memory) {}

  ServerUnaryReactor* Greet(CallbackServerContext* context,
                            const wire::GreetRequest* request,
                            wire::GreetResponse* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller&) {
      RequireWorkerProtocol(
          kWorkerProtocol, request->protocol(), parts_.version, request->release());
      *response = ToWire(parts_.worker_times);
      response->set_release(parts_.version);
      for (const auto& [name, file] : parts_.models.files) {
        wire::Model* model = response->add_models();
        model->set_name(name);
        model->set_sha256(Sha256Hex(DigestsOfModel(file, parts_.digests)));
      }
    });
  }

  ServerUnaryReactor* Claim(CallbackServerContext* context,
                            const wire::ClaimRequest* request,
                            wire::ClaimResponse* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller& caller) {
      RequireWorkerProtocol(
          kWorkerProtocol, request->protocol(), parts_.version, request->release());
      if (parts_.draining) return;
      ClaimTerms terms = FromWire(*request);
      terms.worker = IdOf(caller, terms.worker);
      terms.lease_ms = LeaseMs(terms.lease_ms);
      const std::optional<JobRecord> job = store_.Claim(terms);
      if (job) *response->mutable_job() = ToWire(*job);
    });
  }

  ServerUnaryReactor* Heartbeat(CallbackServerContext* context,
                                const wire::HeartbeatRequest* request,
                                wire::HeartbeatResponse* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller&) {
      const HeartbeatReply reply = store_.Heartbeat(FromWire(request->lease()),
                                                    FromWire(request->progress()),
                                                    FromWire(request->usage()),
                                                    LeaseMs(request->lease_ms()));
      response->set_cancel_requested(reply.cancel_requested);
    });
  }

  ServerUnaryReactor* Peek(CallbackServerContext* context,
                           const wire::Lease* request,
                           wire::HeartbeatResponse* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller&) {
      response->set_cancel_requested(store_.Peek(FromWire(*request)).cancel_requested);
    });
  }

  ServerUnaryReactor* SetCheckpoint(CallbackServerContext* context,
                                    const wire::SetCheckpointRequest* request,
                                    wire::SetCheckpointResponse* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller&) {
      const auto replaced =
          store_.SetCheckpoint(FromWire(request->lease()), FromWire(request->blob()));
      if (replaced) *response->mutable_replaced() = ToWire(*replaced);
    });
  }

  ServerUnaryReactor* JoinEqual(CallbackServerContext* context,
                                const wire::JoinEqualRequest* request,
                                wire::JoinEqualResponse* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller&) {
      response->set_joined(store_.JoinEqual(FromWire(request->lease()), request->stage_key()));
    });
  }

  ServerUnaryReactor* Publish(CallbackServerContext* context,
                              const wire::PublishRequest* request,
                              wire::Done* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller&) {
      Publication publication;
      for (const wire::Artifact& artifact : request->artifacts()) {
        publication.artifacts.push_back(FromWire(artifact));
      }
      publication.stage_key = request->stage_key();
      publication.cached = request->cached();
      publication.usage = FromWire(request->usage());
      store_.Publish(FromWire(request->lease()), publication);
    });
  }

  ServerUnaryReactor* Fail(CallbackServerContext* context,
                           const wire::FailRequest* request,
                           wire::Done* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller&) {
      store_.Fail(
          FromWire(request->lease()), FromWire(request->error()), FromWire(request->usage()));
    });
  }

  ServerUnaryReactor* Release(CallbackServerContext* context,
                              const wire::ReleaseRequest* request,
                              wire::Done* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller&) {
      store_.Release(FromWire(request->lease()), FromWire(request->usage()));
    });
  }

  ServerUnaryReactor* FindStage(CallbackServerContext* context,
                                const wire::FindStageRequest* request,
                                wire::Jobs* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller&) {
      const auto job = store_.FindStage(request->stage_key());
      if (job) *response->add_jobs() = ToWire(*job);
    });
  }

  ServerUnaryReactor* GetScene(CallbackServerContext* context,
                               const wire::Name* request,
                               wire::Scene* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller&) {
      *response = ToWire(store_.GetScene(request->name()));
    });
  }

  ServerUnaryReactor* GetJob(CallbackServerContext* context,
                             const wire::Name* request,
                             wire::Job* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller&) {
      *response = ToWire(store_.GetJob(request->name()));
    });
  }

  ServerUnaryReactor* GetInputs(CallbackServerContext* context,
                                const wire::GetInputsRequest* request,
                                wire::Jobs* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller&) {
      AddJobs(store_.GetInputs(request->job_id()), response);
    });
  }

  ServerUnaryReactor* ListChildren(CallbackServerContext* context,
                                   const wire::Name* request,
                                   wire::Jobs* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller&) {
      AddJobs(store_.ListChildren(request->name()), response);
    });
  }

  ServerUnaryReactor* UpdateWorker(CallbackServerContext* context,
                                   const wire::Worker* request,
                                   wire::Done* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller& caller) {
      WorkerRecord worker = FromWire(*request);
      worker.worker_id = IdOf(caller, worker.worker_id);
      for (std::string* text : {&worker.machine, &worker.release, &worker.simd}) {
        *text = EscapeControls(text->substr(0, kMaxFactBytes));
      }
      if (place_ == WorkerPlace::kElsewhere) worker.pid = 0;
      store_.UpdateWorker(worker);
    });
  }

  ServerUnaryReactor* RemoveWorker(CallbackServerContext* context,
                                   const wire::Name* request,
                                   wire::Done* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller& caller) {
      store_.RemoveWorker(IdOf(caller, request->name()));
    });
  }

  ServerUnaryReactor* ListWorkers(CallbackServerContext* context,
                                  const wire::Done* request,
                                  wire::Workers* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller&) {
      for (const WorkerRecord& worker : store_.ListWorkers()) {
        *response->add_workers() = ToWire(worker);
      }
    });
  }

  ServerUnaryReactor* AppendJobLogs(CallbackServerContext* context,
                                    const wire::AppendJobLogsRequest* request,
                                    wire::Done* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller&) {
      std::map<std::string, std::string> logs;  // lines by job
      for (const wire::JobLogLine& line : request->lines()) {
        CheckName(line.job(), "jobs");
        logs[line.job()] += EscapeControls(CleanUtf8(line.text())) + "\n";
      }
      if (!parts_.job_logs) return;
      for (const auto& [job, lines] : logs) parts_.job_logs->Append(job, lines);
    });
  }

  ServerUnaryReactor* TouchBlob(CallbackServerContext* context,
                                const wire::Digest* request,
                                wire::TouchBlobResponse* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller&) {
      response->set_stored(parts_.blobs.Touch(FromWire(*request)));
    });
  }

  ServerUnaryReactor* LookBlob(CallbackServerContext* context,
                               const wire::LookBlobRequest* request,
                               wire::LookBlobResponse* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller&) {
      const auto blob = parts_.blobs.Look(request->sha256());
      if (blob) *response->mutable_blob() = ToWire(*blob);
    });
  }

  ServerUnaryReactor* IsReferenced(CallbackServerContext* context,
                                   const wire::LookBlobRequest* request,
                                   wire::IsReferencedResponse* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller&) {
      response->set_referenced(store_.IsReferenced(request->sha256()));
    });
  }

  ServerUnaryReactor* RemoveBlob(CallbackServerContext* context,
                                 const wire::StoredBlob* request,
                                 wire::RemoveBlobResponse* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller&) {
      const StoredBlob blob = FromWire(*request);
      response->set_removed(!store_.IsReferenced(blob.digest.sha256) &&
                            parts_.blobs.RemoveIfUntouched(blob));
    });
  }

  grpc::ServerWriteReactor<ReadResponse>* ReadBlob(CallbackServerContext* context,
                                                   const ReadRequest* request) override {
    return color3d::ReadBlob(parts_, *context, *request, Admission());
  }

  grpc::ServerReadReactor<WriteRequest>* WriteBlob(CallbackServerContext* context,
                                                   WriteResponse* response) override {
    return color3d::WriteBlob(parts_, *context, response, Admission());
  }

  ServerUnaryReactor* QueryBlobWrite(CallbackServerContext* context,
                                     const QueryWriteStatusRequest* request,
                                     QueryWriteStatusResponse* response) override {
    return Answer(context, request, response, [=, this](const WorkerCaller&) {
      color3d::QueryBlobWrite(parts_, Rights(), *request, response);
    });
  }

 private:
  // Throws as Access::Require.
  WorkerCaller AdmitWorker(const CallbackServerContext& context) const {
    if (place_ == WorkerPlace::kHere) return {};
    return {parts_.access.Require(Role::kWorker, context).name};
  }

  template <typename Request, typename Response, typename Body>
  ServerUnaryReactor* Answer(CallbackServerContext* context,
                             const Request* request,
                             Response* response,
                             Body body) {
    const auto admit = [&] { return std::pair(AdmitWorker(*context), std::string(kOwner)); };
    return AnswerAdmitted(
        memory_, parts_.errands, context, request, response, admit, std::move(body));
  }

  BlobRights Rights() const {
    return {kOwner,
            [this](const FileDigest& blob) { return parts_.blobs.Touch(blob); },
            [](int64_t) {},
            [](const FileDigest&) {}};
  }
  BlobAdmission Admission() const {
    return [this](const CallbackServerContext& context) {
      AdmitWorker(context);
      return Rights();
    };
  }

  // Workers of other machines cannot take the names of others: theirs end with that of their token.
  std::string IdOf(const WorkerCaller& caller, const std::string& id) const {
    const bool good =
        !id.empty() && id.size() <= 100 && std::ranges::all_of(id, [](unsigned char c) {
          return std::isalnum(c) != 0 || c == '.' || c == '-' || c == '_';
        });
    if (!good) {
      throw InvalidArgument(
          "the worker's name '{}' must be 1 to 100 letters, digits, '.', '-' or '_'; choose "
          "another with --name",
          id.substr(0, 120));
    }
    if (place_ == WorkerPlace::kHere) return id;
    return id + "@" + (caller.name.empty() ? "remote" : caller.name);
  }

  int64_t LeaseMs(int64_t asked) const {
    return std::clamp<int64_t>(asked, 1, parts_.worker_times.lease_ms);
  }

  const RpcParts& parts_;
  WorkerStore& store_;
  const WorkerPlace place_;
  CallMemory& memory_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeWorkerService(const RpcParts& parts,
                                                 WorkerPlace place,
                                                 CallMemory& memory) {
  return std::make_unique<WorkerServiceImpl>(parts, place, memory);
}

}  // namespace color3d
