#include "server/store/postgresql/postgresql_listener.h"

#include <fmt/format.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <pqxx/pqxx>
#include <utility>

#include "server/store/postgresql/postgresql_db.h"
#include "server/store/postgresql/postgresql_schema.h"

namespace color3d {
namespace {

constexpr int kLookMs = 2'000;  // between two tries to get the lock
constexpr std::chrono::seconds kConnectPause{1};

}  // namespace

class PostgresqlListener::Receiver : public pqxx::notification_receiver {
 public:
  Receiver(pqxx::connection_base& connection, PostgresqlListener& listener)
      : notification_receiver(connection, kEventChannel), listener_(listener) {}
  void operator()(const std::string& payload, int) override {
    listener_.Hear(std::strtoll(payload.c_str(), nullptr, 10));
  }

 private:
  PostgresqlListener& listener_;
};

PostgresqlListener::PostgresqlListener(std::string address, bool wants_chores)
    : address_(std::move(address)),
      wants_chores_(wants_chores),
      wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  thread_ = std::thread([this] { Loop(); });
}

PostgresqlListener::~PostgresqlListener() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  changed_.NotifyAll();
  const uint64_t one = 1;
  static_cast<void>(::write(wake_, &one, sizeof(one)));
  thread_.join();
  ::close(wake_);
}

void PostgresqlListener::Loop() {
  while (true) {
    try {
      Listen();
    } catch (const std::exception& e) {
      spdlog::debug("the store is not heard: {}", e.what());
    }
    const MutexLock lock(mutex_);
    newest_ = -1;
    has_chores_ = false;
    const auto end = std::chrono::steady_clock::now() + kConnectPause;
    while (!stopping_ && changed_.WaitUntil(mutex_, end)) {
    }
    if (stopping_) return;
  }
}

// libpqxx would connect again by itself, without the lock.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
void PostgresqlListener::Listen() {
  pqxx::connection connection(WithTimeouts(address_));
  connection.inhibit_reactivation(true);
#pragma GCC diagnostic pop
  const pqxx::quiet_errorhandler quiet(connection);
  const auto number = [&](const std::string& sql) {
    pqxx::nontransaction work(connection);
    const pqxx::result rows = work.exec(sql);
    return rows.empty() ? std::string() : std::string(rows[0][0].c_str());
  };
  number(kPostgresqlSession);
  const Receiver receiver(connection, *this);
  Hear(std::strtoll(
      number("select value from meta where name='newest_revision'").c_str(), nullptr, 10));
  while (true) {
    {
      const MutexLock lock(mutex_);
      if (stopping_) return;
    }
    if (wants_chores_ && !HasChores() &&
        number(fmt::format("select pg_try_advisory_lock({})", kChoresLock)) == "t") {
      const MutexLock lock(mutex_);
      has_chores_ = true;
    }
    pollfd waits[] = {{connection.sock(), POLLIN, 0}, {wake_, POLLIN, 0}};
    const int ready = ::poll(waits, 2, kLookMs);
    // Notices a dead connection.
    if (ready == 0) number("select 1");
    connection.get_notifs();
    if (!connection.is_open()) throw LostConnection("it was closed");
  }
}

void PostgresqlListener::Hear(int64_t revision) {
  {
    const MutexLock lock(mutex_);
    newest_ = std::max(newest_, revision);
  }
  changed_.NotifyAll();
}

int64_t PostgresqlListener::Newest() {
  const MutexLock lock(mutex_);
  return newest_;
}

bool PostgresqlListener::WaitForEvent(int64_t revision, std::chrono::milliseconds limit) {
  const auto end = std::chrono::steady_clock::now() + limit;
  const MutexLock lock(mutex_);
  while (!stopping_ && newest_ <= revision) {
    if (!changed_.WaitUntil(mutex_, end)) break;
  }
  return newest_ > revision;
}

bool PostgresqlListener::HasChores() {
  const MutexLock lock(mutex_);
  return has_chores_;
}

}  // namespace color3d
