#include "server/store/postgresql/postgresql_db.h"

#include <fmt/format.h>
#include <libpq-fe.h>

#include <cstdlib>
#include <pqxx/pqxx>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include "server/store/postgresql/postgresql_schema.h"

namespace color3d {
namespace {

constexpr pqxx::oid kByteaType = 17;
constexpr char kClock[] = "select (extract(epoch from clock_timestamp())*1000)::bigint";

constexpr SqlDialect kPostgresqlDialect = {
    .ordered_join = "join",
    .by_blob_index = "",
    .unindexed = "",
    .position = "strpos",
    .newest_revision = "select value from meta where name='newest_revision'",
    .claim_lock = " for update of job skip locked",
    .keyed_table = "",
    .schema_version = kPostgresqlVersion};

// Replaces ? and ?N by $N.
std::string Numbered(std::string_view sql) {
  std::string text;
  int last = 0;
  for (size_t i = 0; i < sql.size(); ++i) {
    if (sql[i] != '?') {
      text += sql[i];
      continue;
    }
    int number = 0;
    while (i + 1 < sql.size() && sql[i + 1] >= '0' && sql[i + 1] <= '9') {
      number = number * 10 + (sql[++i] - '0');
    }
    if (number == 0) number = last + 1;
    last = std::max(last, number);
    text += fmt::format("${}", number);
  }
  return text;
}

std::string FirstLine(const std::string& text) { return text.substr(0, text.find('\n')); }

[[noreturn]] void ThrowState(const std::string& state, const std::string& message) {
  const std::string text = fmt::format("job store: PostgreSQL: {} ({})", FirstLine(message), state);
  if (state == "53100") {
    throw ServiceError(
        ErrorReason::kStorageFull, "{}; free some disk space on the machine of the database", text);
  }
  if (state == "55P03" || state == "57014" || state == "53300" || state == "53200") {
    throw ServiceError(ErrorReason::kStoreBusy, "{}; try again", text);
  }
  if (state == "25006") {
    throw ServiceError(ErrorReason::kStoreNotWritable,
                       "{}; name the primary server in --store, not a standby",
                       text);
  }
  if (state == "42501") {
    throw ServiceError(
        ErrorReason::kStoreNotWritable, "{}; make the role of --store owner of the database", text);
  }
  if (state == "XX001" || state == "XX002") {
    throw ServiceError(ErrorReason::kStoreCorrupt, "{}; restore the database from a backup", text);
  }
  if (state == "22021") throw InvalidArgument("{}; use valid UTF-8 text", text);
  throw ServiceError(ErrorReason::kStoreError, text);
}

bool EndsConnection(const std::string& state) {
  return state.starts_with("08") || state == "57P01" || state == "57P02" || state == "57P03" ||
         state == "57P05" || state == "25P03";
}

std::string Unhexed(const char* text, size_t size) {
  std::string bytes;
  const auto digit = [](char c) { return c <= '9' ? c - '0' : c - 'a' + 10; };
  for (size_t i = 2; i + 1 < size; i += 2) {
    bytes += static_cast<char>(digit(text[i]) * 16 + digit(text[i + 1]));
  }
  return bytes;
}

}  // namespace

const char kPostgresqlSession[] =
    "set client_min_messages=warning; set bytea_output=hex; set lock_timeout=10000; "
    "set idle_in_transaction_session_timeout=5000; set statement_timeout=120000; "
    "set tcp_keepalives_idle=5; set tcp_keepalives_interval=2; set tcp_keepalives_count=3";

LostConnection::LostConnection(const std::string& why)
    : ServiceError(ErrorReason::kStoreBusy,
                   "job store: the connection to PostgreSQL is lost: {}; try again",
                   FirstLine(why)),
      why_(FirstLine(why)) {}

RolledBack::RolledBack(const std::string& why)
    : ServiceError(
          ErrorReason::kStoreBusy, "job store: PostgreSQL: {}; try again", FirstLine(why)) {}

bool IsPostgresqlAddress(const std::string& text) {
  return text.starts_with("postgresql://") || text.starts_with("postgres://");
}

std::string WithoutPassword(const std::string& address) {
  std::string text = address;
  const size_t begin = text.find("//") + 2;
  const size_t at = text.find('@', begin), colon = text.find(':', begin);
  if (at != std::string::npos && colon < at) text.erase(colon, at - colon);
  const size_t parameter = text.find("password=");
  if (parameter != std::string::npos) {
    text.erase(parameter, std::min(text.find('&', parameter), text.size()) - parameter);
  }
  return text;
}

std::string WithTimeouts(const std::string& address) {
  constexpr char kDefaults[] =
      "connect_timeout=5&keepalives_idle=5&keepalives_interval=2&keepalives_count=3&"
      "tcp_user_timeout=10000&application_name=color3d&client_encoding=UTF8";
  const size_t query = address.find('?');
  if (query == std::string::npos) return address + "?" + kDefaults;
  return address.substr(0, query + 1) + kDefaults + "&" + address.substr(query + 1);
}

void ThrowCannotConnect(const std::string& address, const std::string& why) {
  const std::string shown = WithoutPassword(address);
  if (::PQping(WithTimeouts(address).c_str()) == PQPING_OK) {
    throw Error(ErrorCode::kFailedPrecondition,
                "the job store {} refuses the connection: {}; check role, password (also that of "
                "the passfile) and database of --store",
                shown,
                FirstLine(why));
  }
  throw ServiceError(ErrorReason::kStoreBusy,
                     "the job store {} cannot be reached: {}; start PostgreSQL, or check host and "
                     "port of --store",
                     shown,
                     FirstLine(why));
}

// libpqxx would connect again by itself and go on outside of the transaction.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
struct PostgresqlDatabase::Link {
  explicit Link(const std::string& address) : connection(WithTimeouts(address)) {
    connection.inhibit_reactivation(true);
  }
#pragma GCC diagnostic pop
  pqxx::connection connection;
  pqxx::quiet_errorhandler quiet{connection};
  pqxx::nontransaction work{connection};
  // Statements and how often they were run; those run often are prepared.
  std::unordered_map<std::string, int> runs;
  std::unordered_map<std::string, std::string> prepared;  // their names
  bool in_transaction = false;

  // Runs `body` and converts what it throws.
  template <typename Body>
  pqxx::result Run(const Body& body) {
    try {
      return body();
    } catch (const pqxx::broken_connection& e) {
      throw LostConnection(e.what());
    } catch (const pqxx::statement_completion_unknown& e) {
      throw LostConnection(e.what());
    } catch (const pqxx::transaction_rollback& e) {
      throw RolledBack(e.what());
    } catch (const pqxx::sql_error& e) {
      if (!connection.is_open() || EndsConnection(e.sqlstate())) throw LostConnection(e.what());
      if (e.sqlstate().starts_with("40")) throw RolledBack(e.what());
      ThrowState(e.sqlstate(), e.what());
    } catch (const std::exception& e) {
      if (!connection.is_open()) throw LostConnection(e.what());
      throw ServiceError(ErrorReason::kStoreError, "job store: PostgreSQL: {}", e.what());
    }
  }
  pqxx::result RunText(const std::string& sql) {
    return Run([&] { return work.exec(sql); });
  }
  pqxx::result RunBound(const std::string& sql, const std::vector<std::string>& values) {
    constexpr size_t kMostStatements = 500;
    constexpr int kOften = 3;
    const auto parameters = pqxx::prepare::make_dynamic_params(values);
    const auto known = prepared.find(sql);
    if (known != prepared.end()) {
      return Run([&] { return work.exec_prepared(known->second, parameters); });
    }
    if (runs.size() > kMostStatements) runs.clear();
    if (++runs[sql] < kOften || prepared.size() >= kMostStatements) {
      return Run([&] { return work.exec_params(sql, parameters); });
    }
    runs.erase(sql);
    const std::string name = fmt::format("s{}", prepared.size());
    return Run([&] {
      connection.prepare(name, sql);
      prepared[sql] = name;
      return work.exec_prepared(name, parameters);
    });
  }
};

class PostgresqlCursor : public SqlCursor {
 public:
  PostgresqlCursor(PostgresqlDatabase& db, std::string_view sql) : db_(db), sql_(Numbered(sql)) {}

  void Bind(int64_t value) override { values_.push_back(fmt::to_string(value)); }
  void Bind(double value) override { values_.push_back(fmt::to_string(value)); }
  void Bind(std::string_view text) override {
    if (text.find('\0') != std::string_view::npos) {
      throw InvalidArgument("a text has a NUL character; leave it out");
    }
    values_.emplace_back(text);
  }
  void Bind(SqlBytes bytes) override {
    constexpr char kDigits[] = "0123456789abcdef";
    std::string text = "\\x";
    text.reserve(2 + 2 * bytes.bytes.size());
    for (const char c : bytes.bytes) {
      text += kDigits[static_cast<unsigned char>(c) >> 4];
      text += kDigits[static_cast<unsigned char>(c) & 15];
    }
    values_.push_back(std::move(text));
  }
  bool Step() override {
    if (next_ == 0) {
      rows_ = db_.link_->RunBound(sql_, values_);
      db_.changes_ = static_cast<int64_t>(rows_.affected_rows());
    }
    return next_++ < rows_.size();
  }
  int64_t Int(int column) const override {
    const pqxx::field field = Field(column);
    if (field.is_null()) return 0;
    if (field.c_str()[0] == 't') return 1;
    return std::strtoll(field.c_str(), nullptr, 10);
  }
  double Double(int column) const override {
    const pqxx::field field = Field(column);
    return field.is_null() ? 0.0 : std::strtod(field.c_str(), nullptr);
  }
  std::string Text(int column) const override {
    const pqxx::field field = Field(column);
    if (field.is_null()) return {};
    if (field.type() == kByteaType) return Unhexed(field.c_str(), field.size());
    return {field.c_str(), field.size()};
  }

 private:
  pqxx::field Field(int column) const { return rows_[next_ - 1][column]; }

  PostgresqlDatabase& db_;
  const std::string sql_;
  std::vector<std::string> values_;
  pqxx::result rows_;
  pqxx::result::size_type next_ = 0;  // row after the present one
};

PostgresqlDatabase::PostgresqlDatabase(const std::string& address)
    : link_([&] {
        try {
          return std::make_unique<Link>(address);
        } catch (const std::exception& e) {
          throw LostConnection(e.what());
        }
      }()) {
  Exec(kPostgresqlSession);
}

PostgresqlDatabase::~PostgresqlDatabase() { RollBack(); }

std::unique_ptr<SqlCursor> PostgresqlDatabase::Prepare(std::string_view sql) {
  return std::make_unique<PostgresqlCursor>(*this, sql);
}

void PostgresqlDatabase::Exec(const char* sql) {
  changes_ = static_cast<int64_t>(link_->RunText(sql).affected_rows());
}

const SqlDialect& PostgresqlDatabase::dialect() const { return kPostgresqlDialect; }

int64_t PostgresqlDatabase::Number(const std::string& statements) {
  const pqxx::result rows = link_->RunText(statements);
  return rows.empty() || rows[0][0].is_null() ? 0 : std::strtoll(rows[0][0].c_str(), nullptr, 10);
}

void PostgresqlDatabase::BeginRead() {
  link_->in_transaction = true;
  time_ms_ = Number(std::string("begin isolation level repeatable read read only; ") + kClock);
}

// Each later statement sees all that was committed before the lock was granted.
void PostgresqlDatabase::BeginWrite(bool durable) {
  link_->in_transaction = true;
  time_ms_ =
      Number(fmt::format("begin isolation level read committed read write; {}"
                         "select pg_advisory_xact_lock({}); {}",
                         durable ? "" : "set local synchronous_commit=off; ",
                         kWriterLock,
                         kClock));
}

void PostgresqlDatabase::Commit(const std::string& last) {
  link_->RunText(last + "commit");
  link_->in_transaction = false;
}

void PostgresqlDatabase::RollBack() noexcept {
  if (!link_->in_transaction) return;
  link_->in_transaction = false;
  try {
    link_->RunText("rollback");
  } catch (const std::exception&) {
    // The database rolls back when it notices the end of the connection.
  }
}

bool PostgresqlDatabase::IsOpen() const { return link_->connection.is_open(); }

}  // namespace color3d
