// Connections of one process to a PostgreSQL store: one writer and several readers. Writes of all
// processes take turns by an advisory lock of the database, as they do in SQLite: the state machine
// reads before it writes, and revisions must become visible in their order. Thread-safe.
//
// A transaction is repeated for some seconds if the connection is lost or the database rolls it
// back. If the connection is lost in a commit, the next one first asks whether that commit took
// effect: each durable transaction leaves a mark, so that no effect occurs twice.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "core/base/mutex.h"
#include "server/store/postgresql/postgresql_db.h"
#include "server/store/sql_connections.h"

namespace color3d {

class PostgresqlConnections : public SqlConnections {
 public:
  explicit PostgresqlConnections(std::string address);
  // Returns true if this object has written since the last call.
  bool TakeWritten() { return written_.exchange(false); }

 protected:
  void RunRead(const Action& action) override;
  void RunWrite(const Action& action, bool durable) override;

 private:
  class Patience;

  std::unique_ptr<PostgresqlDatabase> AcquireReader();
  void ReleaseReader(std::unique_ptr<PostgresqlDatabase> reader);
  // Returns true if the write with this number was committed. Waits for its end.
  bool WasCommitted(int64_t number, Patience& patience) COLOR3D_REQUIRES(writing_);

  const std::string address_;
  const std::string session_;  // names the marks of this object
  std::atomic<bool> written_{false};
  Mutex writing_;
  std::unique_ptr<PostgresqlDatabase> writer_ COLOR3D_GUARDED_BY(writing_);
  int64_t writes_ COLOR3D_GUARDED_BY(writing_) = 0;
  Mutex reading_;
  CondVar reader_is_back_;
  std::vector<std::unique_ptr<PostgresqlDatabase>> idle_readers_ COLOR3D_GUARDED_BY(reading_);
  int readers_ COLOR3D_GUARDED_BY(reading_) = 0;  // idle and in use
};

}  // namespace color3d
