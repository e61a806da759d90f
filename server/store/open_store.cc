#include "server/store/open_store.h"

#include <sys/vfs.h>

#include <utility>

#include "core/base/error.h"
#include "core/base/process/host_name.h"
#include "server/store/postgresql/postgresql_job_store.h"
#include "server/store/sqlite_job_store.h"

namespace color3d {
namespace {

OpenedStore OpenSqlite(const std::filesystem::path& file, StoreOptions options) {
  RequireLocalFolder(file.parent_path());
  OpenedStore opened;
  opened.store = std::make_unique<SqliteJobStore>(
      file, StoreRole::kServer, SystemClocks(), std::move(options));
  opened.has_chores = [] { return true; };
  opened.name = file.string();
  return opened;
}

OpenedStore OpenPostgresql(const std::string& address, StoreOptions options) {
  OpenedStore opened;
  options.server_name = HostName("server");
  auto store = std::make_unique<PostgresqlJobStore>(
      address, StoreRole::kServer, std::nullopt, std::move(options));
  opened.has_chores = [store = store.get()] { return store->HasChores(); };
  opened.job_logs = store.get();
  opened.store = std::move(store);
  opened.name = WithoutPassword(address);
  return opened;
}

void RequirePostgresql(const std::string& address) {
  if (IsPostgresqlAddress(address)) return;
  throw InvalidArgument(
      "--store is '{}'; write postgresql://ROLE@HOST:PORT/DATABASE, or leave it out for SQLite",
      address);
}

}  // namespace

const char* NetworkFileSystem(int64_t type) {
  switch (static_cast<uint32_t>(type)) {
    case 0x6969:
      return "NFS";
    case 0x517B:
    case 0xFF534D42:
    case 0xFE534D42:
      return "SMB";
    case 0x01021997:
      return "9P";
    case 0x00C36400:
      return "Ceph";
    case 0x0BD00BD0:
      return "Lustre";
    case 0x47504653:
      return "GPFS";
    case 0x5346414F:
    case 0x6B414653:
      return "AFS";
    case 0x01161970:
      return "GFS2";
    case 0x7461636F:
      return "OCFS2";
    case 0x73757245:
      return "Coda";
    default:
      return nullptr;
  }
}

void RequireLocalFolder(const std::filesystem::path& folder) {
  struct statfs facts {};
  if (::statfs(folder.c_str(), &facts) != 0) return;  // opening it tells why
  const char* name = NetworkFileSystem(facts.f_type);
  if (name == nullptr) return;
  throw Error(ErrorCode::kFailedPrecondition,
              "{} is on a network file system ({}), on which SQLite can lose data; choose a "
              "--data-dir on a local disk, or keep jobs in PostgreSQL (--store postgresql://...)",
              folder.string(),
              name);
}

OpenedStore OpenStore(const std::string& address,
                      const std::filesystem::path& sqlite_file,
                      StoreOptions options) {
  if (address.empty()) return OpenSqlite(sqlite_file, std::move(options));
  RequirePostgresql(address);
  return OpenPostgresql(address, std::move(options));
}

std::unique_ptr<JobStore> OpenStoreAsTool(const std::string& address,
                                          const std::filesystem::path& sqlite_file) {
  if (address.empty()) {
    return std::make_unique<SqliteJobStore>(sqlite_file, StoreRole::kTool, SystemClocks());
  }
  RequirePostgresql(address);
  return std::make_unique<PostgresqlJobStore>(address, StoreRole::kTool, std::nullopt);
}

}  // namespace color3d
