// Connections of one process to the database of the store. Thread-safe.
#pragma once

#include <functional>
#include <optional>
#include <type_traits>
#include <utility>

#include "server/store/sql_database.h"

namespace color3d {

class SqlConnections {
 public:
  virtual ~SqlConnections() = default;

  // Each runs `body(SqlDatabase&)` in one transaction and returns its result. The transaction is
  // rolled back if the body throws. The body may run more than once, and must have no other effect
  // than on the database and on its result; all its runs except the last are rolled back.
  //
  // All reads see one state of the store. Requires: the thread is in no other transaction.
  template <typename Body>
  auto Read(const Body& body) {
    return Collect(body, [&](const Action& action) { RunRead(action); });
  }
  // One at a time, over all processes. It is synced to disk when this returns.
  template <typename Body>
  auto Write(const Body& body) {
    return Collect(body, [&](const Action& action) { RunWrite(action, /*durable=*/true); });
  }
  // The same, but a power failure (not a crash of the process) may lose it. The body may also run
  // again after a run that was committed.
  template <typename Body>
  auto WriteUnsynced(const Body& body) {
    return Collect(body, [&](const Action& action) { RunWrite(action, /*durable=*/false); });
  }

 protected:
  using Action = std::function<void(SqlDatabase&)>;
  virtual void RunRead(const Action& action) = 0;
  virtual void RunWrite(const Action& action, bool durable) = 0;

 private:
  template <typename Body, typename Run>
  static auto Collect(const Body& body, const Run& run) {
    using Result = std::invoke_result_t<Body, SqlDatabase&>;
    if constexpr (std::is_void_v<Result>) {
      run(body);
    } else {
      std::optional<Result> result;
      run([&](SqlDatabase& db) { result.emplace(body(db)); });
      return *std::move(result);
    }
  }
};

}  // namespace color3d
