#include "tests/support/service/postgresql_cluster.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <libpq-fe.h>
#include <pwd.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <thread>

#include "server/store/postgresql/postgresql_db.h"
#include "server/store/postgresql/postgresql_schema.h"

namespace color3d::testing {
namespace fs = std::filesystem;
namespace {

constexpr char kTemplate[] = "color3d_template";

// Folder of the programs of the newest version; empty if there are none.
fs::path ProgramsOfPostgresql() {
  fs::path newest;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/usr/lib/postgresql", error)) {
    const fs::path programs = entry.path() / "bin";
    if (fs::exists(programs / "initdb", error) && programs > newest) newest = programs;
  }
  return newest;
}

// Starts a program as postgres; it ends with this process.
pid_t StartAsPostgres(const std::vector<std::string>& arguments, const fs::path& log) {
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const passwd* user = ::getpwnam("postgres");
  const pid_t pid = ::fork();
  if (pid != 0) return pid;
  const int out = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0666);
  ::dup2(out, 1);
  ::dup2(out, 2);
  if (::geteuid() == 0) {
    if (user == nullptr || ::setgid(user->pw_gid) != 0 || ::setuid(user->pw_uid) != 0) ::_exit(126);
  }
  ::prctl(PR_SET_PDEATHSIG, SIGQUIT);
  ::setenv("LC_ALL", "C", 1);
  ::execv(argv[0], argv.data());
  ::_exit(127);
}

}  // namespace

bool PostgresqlCluster::IsInstalled() { return !ProgramsOfPostgresql().empty(); }

PostgresqlCluster& PostgresqlCluster::Shared() {
  static PostgresqlCluster cluster;
  return cluster;
}

PostgresqlCluster::PostgresqlCluster(std::vector<std::string> settings)
    : settings_(std::move(settings)) {
  const passwd* user = ::getpwnam("postgres");
  if (::geteuid() == 0 && user != nullptr) {
    static_cast<void>(::chown(folder_.c_str(), user->pw_uid, user->pw_gid));
  }
  const pid_t initdb = StartAsPostgres({(ProgramsOfPostgresql() / "initdb").string(),
                                        "-D",
                                        (folder_ / "data").string(),
                                        "-A",
                                        "trust",
                                        "-U",
                                        "postgres",
                                        "-E",
                                        "UTF8",
                                        "--locale=C",
                                        "--no-sync"},
                                       folder_ / "initdb.log");
  int status = 0;
  ::waitpid(initdb, &status, 0);
  if (status != 0)
    throw std::runtime_error("initdb failed; see " + folder_.string() + "/initdb.log");
  Start();
}

PostgresqlCluster::~PostgresqlCluster() {
  if (server_ != 0) {
    ::kill(server_, SIGQUIT);
    ::waitpid(server_, nullptr, 0);
  }
}

std::string PostgresqlCluster::AddressOf(const std::string& database) const {
  std::string host;
  for (const char c : folder_.string()) host += c == '/' ? std::string("%2F") : std::string(1, c);
  return "postgresql://postgres@" + host + "/" + database;
}

fs::path PostgresqlCluster::Socket() const { return folder_ / ".s.PGSQL.5432"; }

void PostgresqlCluster::Start() {
  std::vector<std::string> arguments = {(ProgramsOfPostgresql() / "postgres").string(),
                                        "-D",
                                        (folder_ / "data").string(),
                                        "-k",
                                        folder_.string()};
  for (const char* setting : {"listen_addresses=",
                              "fsync=off",
                              "max_connections=100",
                              "shared_buffers=16MB",
                              "autovacuum=off"}) {
    arguments.insert(arguments.end(), {"-c", setting});
  }
  for (const std::string& setting : settings_) arguments.insert(arguments.end(), {"-c", setting});
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (std::chrono::steady_clock::now() < end) {
    // It refuses to start until the processes of a killed one have ended.
    if (server_ == 0) server_ = StartAsPostgres(arguments, folder_ / "postgres.log");
    if (::PQping(AddressOf("postgres").c_str()) == PQPING_OK) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    if (::waitpid(server_, nullptr, WNOHANG) == server_) server_ = 0;
  }
  throw std::runtime_error("PostgreSQL does not start; see " + folder_.string() + "/postgres.log");
}

void PostgresqlCluster::AllowFrom(const std::string& addresses) {
  std::ofstream(folder_ / "data" / "pg_hba.conf", std::ios::app)
      << "host all all " << addresses << " trust\n";
  Run("select pg_reload_conf()");
}

void PostgresqlCluster::Kill() {
  ::kill(server_, SIGKILL);
  ::waitpid(server_, nullptr, 0);
  server_ = 0;
}

void PostgresqlCluster::Run(const std::string& sql, const std::string& database) const {
  PostgresqlDatabase(AddressOf(database)).Exec(sql.c_str());
}

std::string PostgresqlCluster::NewDatabase(bool with_tables) {
  if (with_tables && !has_template_) {
    Run(fmt::format("create database {}", kTemplate));
    PreparePostgresql(AddressOf(kTemplate), StoreRole::kServer, "");
    has_template_ = true;
  }
  const std::string name = fmt::format("test_{}", ++databases_);
  Run(fmt::format(
      "create database {} {}", name, with_tables ? std::string("template ") + kTemplate : ""));
  return AddressOf(name);
}

}  // namespace color3d::testing
