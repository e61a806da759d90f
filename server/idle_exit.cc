#include "server/idle_exit.h"

#include <signal.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "core/base/error.h"

namespace color3d {

std::unique_ptr<IdleWatch> ExitWhenIdle(std::chrono::milliseconds limit,
                                        JobStore& store,
                                        const RpcServer& server) {
  if (limit.count() <= 0) return nullptr;
  const auto is_busy = [&store, &server] {
    const RpcServer::Open open = server.open();
    if (open.watches + open.downloads + open.uploads + open.live_pictures > 0) return true;
    try {
      const JobCounts jobs = store.CountJobs();
      return jobs.queued + jobs.running > 0;
    } catch (const Error& e) {
      spdlog::warn("cannot tell whether jobs are unfinished: {}", e.what());
      return true;
    }
  };
  return std::make_unique<IdleWatch>(limit, is_busy, [limit] {
    spdlog::info("ending, because nobody has used this server for {} s", limit.count() / 1000.0);
    ::kill(::getpid(), SIGTERM);
  });
}

}  // namespace color3d
