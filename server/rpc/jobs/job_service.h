// color3d.v1.JobService.
#pragma once

#include "color3d/v1/job.grpc.pb.h"
#include "server/rpc/calls/rpc_parts.h"
#include "server/rpc/jobs/watch_hub.h"

namespace color3d {

class JobServiceImpl final : public v1::JobService::CallbackService {
 public:
  JobServiceImpl(const RpcParts& parts, WatchHub& hub) : parts_(parts), hub_(hub) {}

  grpc::ServerUnaryReactor* CreateJob(grpc::CallbackServerContext* context,
                                      const v1::CreateJobRequest* request,
                                      v1::Job* response) override;
  grpc::ServerUnaryReactor* GetJob(grpc::CallbackServerContext* context,
                                   const v1::GetJobRequest* request,
                                   v1::Job* response) override;
  grpc::ServerUnaryReactor* ListJobs(grpc::CallbackServerContext* context,
                                     const v1::ListJobsRequest* request,
                                     v1::ListJobsResponse* response) override;
  grpc::ServerUnaryReactor* CancelJob(grpc::CallbackServerContext* context,
                                      const v1::CancelJobRequest* request,
                                      v1::Job* response) override;
  grpc::ServerUnaryReactor* RetryJob(grpc::CallbackServerContext* context,
                                     const v1::RetryJobRequest* request,
                                     v1::Job* response) override;
  grpc::ServerUnaryReactor* DeleteJob(grpc::CallbackServerContext* context,
                                      const v1::DeleteJobRequest* request,
                                      v1::DeleteJobResponse* response) override;
  grpc::ServerUnaryReactor* PinJob(grpc::CallbackServerContext* context,
                                   const v1::PinJobRequest* request,
                                   v1::Job* response) override;
  grpc::ServerWriteReactor<v1::JobLogChunk>* ReadJobLog(
      grpc::CallbackServerContext* context, const v1::ReadJobLogRequest* request) override;
  grpc::ServerWriteReactor<v1::JobEvent>* WatchJobs(grpc::CallbackServerContext* context,
                                                    const v1::WatchJobsRequest* request) override;

 private:
  const RpcParts& parts_;
  WatchHub& hub_;
};

}  // namespace color3d
