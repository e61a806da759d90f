#include "server/store/postgresql/postgresql_job_store.h"

#include <algorithm>
#include <utility>

#include "server/store/postgresql/postgresql_schema.h"

namespace color3d {
namespace {

std::shared_ptr<PostgresqlConnections> PreparedConnections(const std::string& address,
                                                           StoreRole role,
                                                           const StoreOptions& options) {
  PreparePostgresql(address, role, options.program_version);
  return std::make_shared<PostgresqlConnections>(address);
}

}  // namespace

PostgresqlJobStore::PostgresqlJobStore(const std::string& address,
                                       StoreRole role,
                                       std::optional<Clocks> clocks,
                                       StoreOptions options)
    : PostgresqlJobStore(
          PreparedConnections(address, role, options), address, role, std::move(clocks), options) {}

PostgresqlJobStore::PostgresqlJobStore(std::shared_ptr<PostgresqlConnections> connections,
                                       const std::string& address,
                                       StoreRole role,
                                       std::optional<Clocks> clocks,
                                       const StoreOptions& options)
    : SqlJobStore(connections, std::move(clocks), options),
      connections_(std::move(connections)),
      listener_(address, role == StoreRole::kServer) {}

int64_t PostgresqlJobStore::ReturnFreeSpace(int64_t) { return 0; }

std::vector<EventRecord> PostgresqlJobStore::EventsSince(int64_t revision, int limit) {
  const bool has_written = connections_->TakeWritten();
  const int64_t newest = listener_.Newest();
  if (!has_written && newest >= 0 && newest <= revision) return {};
  return SqlJobStore::EventsSince(revision, limit);
}

void PostgresqlJobStore::AppendJobLog(const std::string& job, const std::string& lines) {
  constexpr int64_t kMaxBytes = 1 << 20;
  constexpr char kFull[] = "the log is full; further lines are in the log of the worker\n";
  connections_->WriteUnsynced([&](SqlDatabase& db) {
    SqlStatement end(db,
                     "select j.job_id, coalesce((select first_byte+octet_length(lines) from "
                     "job_log l where l.job_id=j.job_id order by first_byte desc limit 1), 0) from "
                     "job j where name=?",
                     job);
    if (!end.Step() || end.Int(1) >= kMaxBytes) return;
    const bool is_last = end.Int(1) + static_cast<int64_t>(lines.size()) >= kMaxBytes;
    db.Run("insert into job_log values(?,?,?)",
           end.Int(0),
           end.Int(1),
           is_last ? lines + kFull : lines);
  });
}

std::string PostgresqlJobStore::ReadJobLog(const std::string& job,
                                           int64_t offset,
                                           size_t max_bytes) {
  return connections_->Read([&](SqlDatabase& db) {
    std::string bytes;
    SqlStatement rows(db,
                      "select first_byte, lines from job_log where job_id=(select job_id from job "
                      "where name=?1) and first_byte+octet_length(lines)>?2 and first_byte<?3 "
                      "order by first_byte",
                      job,
                      offset,
                      offset + static_cast<int64_t>(max_bytes));
    while (rows.Step()) {
      const std::string lines = rows.Text(1);
      const auto skipped = static_cast<size_t>(std::max<int64_t>(0, offset - rows.Int(0)));
      bytes += lines.substr(std::min(skipped, lines.size()));
    }
    return bytes;
  });
}

}  // namespace color3d
