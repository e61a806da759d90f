#include "core/report/curves.h"

#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <utility>

#include "core/base/error.h"

namespace color3d {
namespace {

std::string NumberText(double value) {
  char buffer[64];
  const auto end = std::to_chars(buffer, buffer + sizeof(buffer), value).ptr;
  return std::string(buffer, end);
}

double ParseNumber(std::string_view text, int line) {
  double value = 0.0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size()) {
    throw InvalidArgument("curves, line {}: \"{}\" is not a number", line, text);
  }
  return value;
}

constexpr std::string_view kHeader = "stage,seconds,iteration,error_name,value";

constexpr size_t kPrefix = sizeof(double) + sizeof(uint64_t);

[[noreturn]] void ThrowDamaged(const std::string& stage) {
  throw Error(ErrorCode::kDataLoss, "the checkpoint of {} is damaged", stage);
}

// Seconds and the length of the CSV. Requires: `bytes` has at least kPrefix bytes.
std::pair<double, uint64_t> ParsePrefix(std::string_view bytes, const std::string& stage) {
  double seconds = 0.0;
  uint64_t length = 0;
  std::memcpy(&seconds, bytes.data(), sizeof(seconds));
  std::memcpy(&length, bytes.data() + sizeof(seconds), sizeof(length));
  if (length > bytes.size() - kPrefix || !std::isfinite(seconds)) ThrowDamaged(stage);
  return {seconds, length};
}

}  // namespace

std::string CurvesToCsv(const std::vector<CurvePoint>& points) {
  std::string csv(kHeader);
  csv += '\n';
  for (const CurvePoint& p : points) {
    csv += p.stage + ',' + NumberText(p.seconds) + ',' + std::to_string(p.iteration) + ',' +
           p.error_name + ',' + NumberText(p.value) + '\n';
  }
  return csv;
}

std::vector<CurvePoint> CurvesFromCsv(std::string_view csv) {
  std::vector<CurvePoint> points;
  int line_number = 0;
  while (!csv.empty()) {
    const size_t end = csv.find('\n');
    std::string_view line = csv.substr(0, end);
    csv.remove_prefix(end == std::string_view::npos ? csv.size() : end + 1);
    ++line_number;
    if (line.empty() || line == kHeader) continue;
    std::vector<std::string_view> fields;
    while (true) {
      const size_t comma = line.find(',');
      fields.push_back(line.substr(0, comma));
      if (comma == std::string_view::npos) break;
      line.remove_prefix(comma + 1);
    }
    if (fields.size() != 5) {
      throw InvalidArgument(
          "curves, line {} has {} fields instead of 5", line_number, fields.size());
    }
    CurvePoint point;
    point.stage = fields[0];
    point.seconds = ParseNumber(fields[1], line_number);
    point.iteration = static_cast<int64_t>(ParseNumber(fields[2], line_number));
    point.error_name = fields[3];
    point.value = ParseNumber(fields[4], line_number);
    points.push_back(std::move(point));
  }
  return points;
}

CurveRecorder::CurveRecorder(std::string stage,
                             ProgressObserver& outer,
                             CheckpointStore& checkpoints)
    : stage_(std::move(stage)), outer_(outer), checkpoints_(checkpoints) {}

double CurveRecorder::Seconds() const {
  return earlier_seconds_ +
         std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

void CurveRecorder::OnProgress(int64_t step, int64_t total_steps, const std::string& message) {
  outer_.OnProgress(step, total_steps, message);
}

void CurveRecorder::OnError(int64_t iteration, const std::string& error_name, double value) {
  if (std::isfinite(value)) {
    const MutexLock lock(mutex_);
    points_.push_back({stage_, Seconds(), iteration, error_name, value});
  }
  outer_.OnError(iteration, error_name, value);
}

void CurveRecorder::OnWarning(const std::string& message) { outer_.OnWarning(message); }

std::vector<CurvePoint> CurveRecorder::points() const {
  const MutexLock lock(mutex_);
  return points_;
}

// Seconds (float64), length of the CSV (uint64), CSV. Precedes a state in memory; follows a state
// in a file, with its own length (uint64) at the end.
std::string CurveRecorder::Facts() const {
  const double seconds = Seconds();
  const std::string csv = CurvesToCsv(points());
  const uint64_t length = csv.size();
  std::string bytes(kPrefix, '\0');
  std::memcpy(bytes.data(), &seconds, sizeof(seconds));
  std::memcpy(bytes.data() + sizeof(seconds), &length, sizeof(length));
  return bytes + csv;
}

void CurveRecorder::TakeFacts(double seconds, std::string_view csv) {
  const MutexLock lock(mutex_);
  points_ = CurvesFromCsv(csv);
  earlier_seconds_ = seconds;
}

void CurveRecorder::Save(const std::string& state) { checkpoints_.Save(Facts() + state); }

std::optional<std::string> CurveRecorder::Load() {
  std::optional<std::string> bytes = checkpoints_.Load();
  if (!bytes || bytes->size() < kPrefix) return std::nullopt;
  const auto [seconds, length] = ParsePrefix(*bytes, stage_);
  TakeFacts(seconds, std::string_view(*bytes).substr(kPrefix, length));
  return bytes->substr(kPrefix + length);
}

void CurveRecorder::SaveFile(const std::filesystem::path& file) {
  const std::string facts = Facts();
  const uint64_t length = facts.size();
  {
    std::ofstream out(file, std::ios::binary | std::ios::app);
    out.write(facts.data(), static_cast<std::streamsize>(length));
    out.write(reinterpret_cast<const char*>(&length), sizeof(length));
    if (!out.flush()) throw Error(ErrorCode::kResourceExhausted, "cannot write {}", file.string());
  }
  checkpoints_.SaveFile(file);
}

bool CurveRecorder::LoadTo(const std::filesystem::path& file) {
  if (!checkpoints_.LoadTo(file)) return false;
  const uint64_t size = std::filesystem::file_size(file);
  uint64_t length = 0;
  if (size < sizeof(length) + kPrefix) return false;
  std::string facts;
  {
    std::ifstream in(file, std::ios::binary);
    in.seekg(static_cast<std::streamoff>(size - sizeof(length)));
    in.read(reinterpret_cast<char*>(&length), sizeof(length));
    if (length < kPrefix || length > size - sizeof(length)) ThrowDamaged(stage_);
    facts.resize(length);
    in.seekg(static_cast<std::streamoff>(size - sizeof(length) - length));
    in.read(facts.data(), static_cast<std::streamsize>(length));
    if (!in) ThrowDamaged(stage_);
  }
  const auto [seconds, csv_length] = ParsePrefix(facts, stage_);
  TakeFacts(seconds, std::string_view(facts).substr(kPrefix, csv_length));
  std::filesystem::resize_file(file, size - sizeof(length) - length);
  return true;
}

}  // namespace color3d
