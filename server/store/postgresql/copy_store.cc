#include "server/store/postgresql/copy_store.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "core/base/digest.h"
#include "server/base/service_error.h"
#include "server/store/postgresql/postgresql_db.h"
#include "server/store/postgresql/postgresql_schema.h"
#include "server/store/schema.h"
#include "server/store/sqlite_db.h"
#include "server/store/store_file.h"

namespace color3d {
namespace {

constexpr int64_t kNull = INT64_MIN + 1;  // stands for NULL between the databases

// Tables in an order in which rows come after those that they name, with the columns of their keys.
// Triggers fill `project` and `meta` meanwhile, so these come last. Workers are not copied.
struct Table {
  const char* name;
  std::vector<std::string> key;
};
const Table kCopied[] = {{"scene", {"scene_id"}},
                         {"scene_file", {"scene_file_id"}},
                         {"job", {"job_id"}},
                         {"job_dependency", {"job_id", "input_id"}},
                         {"job_blob", {"job_id", "sha256"}},
                         {"artifact", {"job_id", "name"}},
                         {"job_attempt", {"job_id", "epoch"}},
                         {"job_event", {"revision"}},
                         {"blob_candidate", {"sha256"}},
                         {"request_id", {"method", "id"}},
                         {"blob_holding", {"project", "sha256"}},
                         {"notification", {"job_id"}},
                         {"expiry_candidate", {"job_id"}},
                         {"project", {"name"}}};

enum class Type { kInteger, kReal, kText, kBytes };
struct Column {
  std::string name;
  Type type = Type::kText;
  bool can_be_null = false;
};

std::vector<Column> ColumnsOf(SqlDatabase& target, const char* table) {
  SqlStatement select(target,
                      "select column_name::text, data_type::text, is_nullable='YES' from "
                      "information_schema.columns where table_name=? and "
                      "table_schema=current_schema() order by ordinal_position",
                      table);
  return select.All([](const SqlStatement& row) {
    const std::string type = row.Text(1);
    return Column{row.Text(0),
                  type == "bigint"             ? Type::kInteger
                  : type == "double precision" ? Type::kReal
                  : type == "bytea"            ? Type::kBytes
                                               : Type::kText,
                  row.Int(2) != 0};
  });
}

// What is selected of a column. Steady times of a machine mean nothing in the database.
std::string Selected(const Column& column, bool from_sqlite) {
  if (column.name == "run_after_ms" || column.name == "preferred_until_ms") {
    return from_sqlite ? "0" : column.name;
  }
  if (column.name == "lease_expires_ms" && from_sqlite) {
    return fmt::format("case when {0} is null then {1} else 0 end", column.name, kNull);
  }
  return column.can_be_null ? fmt::format("coalesce({}, {})", column.name, kNull) : column.name;
}

std::string SelectRows(const Table& table, const std::vector<Column>& columns, bool from_sqlite) {
  std::string list, order;
  for (const Column& column : columns) {
    list += (list.empty() ? "" : ", ") + Selected(column, from_sqlite);
  }
  for (const std::string& key : table.key) {
    const bool is_text = std::ranges::any_of(columns, [&](const Column& column) {
      return column.name == key && column.type == Type::kText;
    });
    // By bytes, as in SQLite.
    order += (order.empty() ? "" : ", ") + key + (is_text && !from_sqlite ? " collate \"C\"" : "");
  }
  return fmt::format("select {} from {} order by {}", list, table.name, order);
}

// Digest of the values of rows, in their order.
class RowsDigest {
 public:
  void Add(const std::string& value) {
    text_ += fmt::format("{}:", value.size()) + value;
    if (text_.size() > (1 << 20)) text_ = Sha256Hex(text_);
  }
  std::string Take() const { return Sha256Hex(text_); }

 private:
  std::string text_;
};

// Reads a row into `insert` (if any) and the digest.
void TakeRow(const SqlStatement& row,
             const std::vector<Column>& columns,
             SqlStatement* insert,
             RowsDigest* digest) {
  for (size_t i = 0; i < columns.size(); ++i) {
    const int column = static_cast<int>(i);
    switch (columns[i].type) {
      case Type::kInteger:
        digest->Add(fmt::to_string(row.Int(column)));
        if (insert != nullptr) insert->Bind(row.Int(column));
        break;
      case Type::kReal:
        digest->Add(fmt::to_string(row.Double(column)));
        if (insert != nullptr) insert->Bind(row.Double(column));
        break;
      case Type::kText:
        digest->Add(row.Text(column));
        if (insert != nullptr) insert->Bind(row.Text(column));
        break;
      case Type::kBytes: {
        const std::string bytes = row.Text(column);
        digest->Add(bytes);
        if (insert != nullptr) insert->Bind(SqlBytes{bytes});
        break;
      }
    }
  }
}

std::string InsertRow(const Table& table, const std::vector<Column>& columns) {
  std::string names, places;
  for (const Column& column : columns) {
    names += (names.empty() ? "" : ", ") + column.name;
    places += places.empty() ? "" : ", ";
    places += column.can_be_null ? fmt::format("nullif(?::bigint, {})", kNull) : "?";
  }
  return fmt::format("insert into {}({}) values({})", table.name, names, places);
}

struct Sum {
  int64_t rows = 0;
  std::string digest;
  bool operator==(const Sum&) const = default;
};

Sum CopyTable(SqlDatabase& source,
              PostgresqlDatabase& target,
              const Table& table,
              const std::function<void(const std::string&, int64_t)>& progress) {
  constexpr int64_t kBatch = 1000;
  const std::vector<Column> columns = ColumnsOf(target, table.name);
  const std::string insert_row = InsertRow(table, columns);
  Sum sum;
  RowsDigest digest;
  SqlStatement rows(source, SelectRows(table, columns, /*from_sqlite=*/true));
  target.BeginWrite(/*durable=*/false);
  target.Exec(fmt::format("delete from {}", table.name).c_str());
  while (rows.Step()) {
    SqlStatement insert(target, insert_row);
    TakeRow(rows, columns, &insert, &digest);
    insert.Run();
    if (++sum.rows % kBatch != 0) continue;
    target.Commit("");
    progress(table.name, sum.rows);
    target.BeginWrite(/*durable=*/false);
  }
  target.Commit("");
  progress(table.name, sum.rows);
  sum.digest = digest.Take();
  return sum;
}

Sum ReadTable(SqlDatabase& target, const Table& table) {
  const std::vector<Column> columns = ColumnsOf(target, table.name);
  Sum sum;
  RowsDigest digest;
  const std::string name = fmt::format("copied_{}", table.name);
  target.Exec(fmt::format("declare {} no scroll cursor for {}",
                          name,
                          SelectRows(table, columns, /*from_sqlite=*/false))
                  .c_str());
  for (bool more = true; more;) {
    more = false;
    SqlStatement rows(target, fmt::format("fetch 200 from {}", name));
    while (rows.Step()) {
      TakeRow(rows, columns, nullptr, &digest);
      ++sum.rows;
      more = true;
    }
  }
  sum.digest = digest.Take();
  return sum;
}

void RequireSource(SqlDatabase& source, const std::filesystem::path& file) {
  SqlStatement version(source, "select version from schema_version");
  const int64_t found = version.Step() ? version.Int(0) : 0;
  if (found == kSchemaVersion) return;
  throw ServiceError(ErrorReason::kStoreVersion,
                     "{} has version {}, this program reads version {}; start color3d-server serve "
                     "of this release on it once",
                     file.string(),
                     found,
                     kSchemaVersion);
}

// Sets what is not a copied row: counters and settings.
void CopyCounters(SqlDatabase& source, PostgresqlDatabase& target) {
  const auto number = [&](const char* sql) { return SqlStatement(source, sql).NextInt(); };
  const auto set = [&](const char* name, int64_t value) {
    target.Run("update meta set value=? where name=?", value, name);
  };
  target.BeginWrite(/*durable=*/true);
  set("newest_revision", number("select seq from sqlite_sequence where name='job_event'"));
  for (const char* name : {"compacted_revision", "hold_paused", "requests_noted_ms"}) {
    set(name, SqlStatement(source, "select value from meta where name=?", name).NextInt());
  }
  const std::pair<const char*, const char*> ids[] = {
      {"scene", "scene_id"}, {"job", "job_id"}, {"job_event", "revision"}};
  for (const auto& [table, column] : ids) {
    const int64_t last =
        SqlStatement(source, "select seq from sqlite_sequence where name=?", table).NextInt();
    target.Run(
        fmt::format("select setval(pg_get_serial_sequence('{}', '{}'), ?::bigint + 1, false)",
                    table,
                    column),
        last);
  }
  target.Exec(
      "select setval(pg_get_serial_sequence('scene_file', 'scene_file_id'), (select "
      "coalesce(max(scene_file_id), 0) + 1 from scene_file), false)");
  target.Exec("delete from meta where name='copying'");
  target.Commit("");
}

}  // namespace

CopiedStore CopyToPostgresql(
    const std::filesystem::path& sqlite_file,
    const std::string& address,
    const std::function<void(const std::string& table, int64_t rows)>& progress) {
  RequireStore(sqlite_file);
  SqliteDatabase source(sqlite_file, SqliteAccess::kRead);
  RequireSource(source, sqlite_file);
  PreparePostgresqlForCopy(address);
  PostgresqlDatabase target(address);
  source.Exec("begin");  // one state of the source
  std::map<std::string, Sum> sums;
  for (const Table& table : kCopied) {
    sums[table.name] = CopyTable(source, target, table, progress);
  }
  target.BeginRead();
  CopiedStore copied;
  for (const Table& table : kCopied) {
    const Sum found = ReadTable(target, table);
    if (found != sums[table.name]) {
      throw Error(ErrorCode::kDataLoss,
                  "the copy of the table {} differs: {} rows of {}; repeat the copy",
                  table.name,
                  found.rows,
                  sums[table.name].rows);
    }
    copied.rows[table.name] = found.rows;
  }
  target.RollBack();
  CopyCounters(source, target);
  source.Exec("rollback");
  return copied;
}

}  // namespace color3d
