#include "server/store/postgresql/postgresql_connections.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "server/store/job.h"
#include "server/store/postgresql/postgresql_schema.h"

namespace color3d {
namespace {

constexpr int kMostReaders = 4;
constexpr std::chrono::seconds kPatienceTime{15};
using SteadyClock = std::chrono::steady_clock;

}  // namespace

// Pauses between tries, which grow; after kPatienceTime the error is thrown on.
class PostgresqlConnections::Patience {
 public:
  // Must be called in a handler of the error. Returns after the pause before the next try.
  void PauseOrThrow() {
    if (SteadyClock::now() >= end_) throw;
    std::this_thread::sleep_for(pause_);
    pause_ = std::min(pause_ * 2, std::chrono::milliseconds(500));
  }

 private:
  const SteadyClock::time_point end_ = SteadyClock::now() + kPatienceTime;
  std::chrono::milliseconds pause_{5};
};

PostgresqlConnections::PostgresqlConnections(std::string address)
    : address_(std::move(address)), session_(NewId()) {}

std::unique_ptr<PostgresqlDatabase> PostgresqlConnections::AcquireReader() {
  const MutexLock lock(reading_);
  while (idle_readers_.empty() && readers_ >= kMostReaders) reader_is_back_.Wait(reading_);
  if (idle_readers_.empty()) {
    ++readers_;
    return nullptr;
  }
  std::unique_ptr<PostgresqlDatabase> reader = std::move(idle_readers_.back());
  idle_readers_.pop_back();
  return reader;
}

void PostgresqlConnections::ReleaseReader(std::unique_ptr<PostgresqlDatabase> reader) {
  {
    const MutexLock lock(reading_);
    if (reader && reader->IsOpen()) {
      idle_readers_.push_back(std::move(reader));
    } else {
      --readers_;
    }
  }
  reader_is_back_.NotifyOne();
}

void PostgresqlConnections::RunRead(const Action& action) {
  std::unique_ptr<PostgresqlDatabase> db = AcquireReader();
  const std::shared_ptr<void> back(nullptr, [&](void*) { ReleaseReader(std::move(db)); });
  Patience patience;
  while (true) {
    try {
      if (!db) db = std::make_unique<PostgresqlDatabase>(address_);
      db->BeginRead();
      action(*db);
      db->RollBack();
      return;
    } catch (const LostConnection&) {
      db.reset();
      patience.PauseOrThrow();
    } catch (const RolledBack&) {
      db->RollBack();
      patience.PauseOrThrow();
    } catch (...) {
      if (db) db->RollBack();
      throw;
    }
  }
}

void PostgresqlConnections::RunWrite(const Action& action, bool durable) {
  const MutexLock lock(writing_);
  Patience patience;
  while (true) {
    bool committing = false;
    const int64_t number = ++writes_;
    try {
      if (!writer_) writer_ = std::make_unique<PostgresqlDatabase>(address_);
      writer_->BeginWrite(durable);
      action(*writer_);
      const std::string mark = fmt::format(
          "insert into commit_mark values('{}', {}, {}) on conflict(session) do update "
          "set number=excluded.number, at_ms=excluded.at_ms; ",
          session_,
          number,
          writer_->Time());
      committing = true;
      writer_->Commit(durable ? mark : "");
      written_ = true;
      return;
    } catch (const LostConnection& e) {
      writer_.reset();
      spdlog::debug("{}", e.what());
      patience.PauseOrThrow();
      // A repeated unsynced write has the effect of one.
      if (committing && durable && WasCommitted(number, patience)) {
        written_ = true;
        return;
      }
    } catch (const RolledBack&) {
      writer_->RollBack();
      patience.PauseOrThrow();
    } catch (...) {
      if (writer_) writer_->RollBack();
      // The next one may reach another server.
      if (writer_ && !writer_->IsOpen()) writer_.reset();
      throw;
    }
  }
}

bool PostgresqlConnections::WasCommitted(int64_t number, Patience& patience) {
  while (true) {
    try {
      if (!writer_) writer_ = std::make_unique<PostgresqlDatabase>(address_);
      // The lock is granted when the lost transaction has ended.
      writer_->BeginWrite(/*durable=*/false);
      const int64_t committed =
          SqlStatement(*writer_, "select number from commit_mark where session=?", session_)
              .NextInt();
      writer_->RollBack();
      return committed == number;
    } catch (const LostConnection&) {
      writer_.reset();
      patience.PauseOrThrow();
    }
  }
}

}  // namespace color3d
