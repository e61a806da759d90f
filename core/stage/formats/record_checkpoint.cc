#include "core/stage/formats/record_checkpoint.h"

#include <fmt/format.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/base/error.h"

namespace color3d {

using nlohmann::json;
namespace fs = std::filesystem;

namespace {

// A record: its length (uint64) and CBOR.
void Write(const json& record, std::ostream& out) {
  std::string bytes;
  json::to_cbor(record, bytes);
  const uint64_t length = bytes.size();
  out.write(reinterpret_cast<const char*>(&length), sizeof(length));
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

// Throws json::exception or Error{kDataLoss}.
void ForEachRecord(const fs::path& file,
                   const std::string& magic,
                   const RecordCheckpoint::OnRecord& on_record) {
  const Error damaged(ErrorCode::kDataLoss, "it ends too soon");
  std::ifstream in(file, std::ios::binary);
  uint64_t left = fs::file_size(file);
  std::string bytes(magic.size(), '\0');
  if (!in.read(bytes.data(), static_cast<std::streamsize>(bytes.size())) || bytes != magic) {
    throw Error(ErrorCode::kDataLoss, "it has another version");
  }
  left -= bytes.size();
  while (left > 0) {
    uint64_t length = 0;
    if (left < sizeof(length)) throw damaged;
    in.read(reinterpret_cast<char*>(&length), sizeof(length));
    left -= sizeof(length);
    if (length > left) throw damaged;
    bytes.resize(length);
    if (!in.read(bytes.data(), static_cast<std::streamsize>(length))) throw damaged;
    left -= length;
    on_record(json::from_cbor(bytes));
  }
}

}  // namespace

RecordCheckpoint::RecordCheckpoint(std::string stage, std::string magic, StageContext& context)
    : stage_(std::move(stage)),
      magic_(std::move(magic)),
      context_(context),
      file_(FileOf("records"), std::ios::binary | std::ios::trunc) {
  file_ << magic_;
}

void RecordCheckpoint::Restore(const OnRecord& check, const OnRecord& take) {
  const fs::path before = FileOf("before");
  try {
    if (context_.checkpoints().LoadTo(before)) {
      try {
        ForEachRecord(before, magic_, check);
      } catch (const json::exception& e) {
        throw Error(ErrorCode::kDataLoss, "{}", e.what());
      }
      ForEachRecord(before, magic_, take);
    }
  } catch (const Error& e) {
    if (e.code() != ErrorCode::kDataLoss && e.code() != ErrorCode::kNotFound) throw;
    context_.Warn("{} starts afresh: its checkpoint is damaged ({})", stage_, e.what());
  }
  fs::remove(before);
}

void RecordCheckpoint::Append(const json& record) { Write(record, file_); }

void RecordCheckpoint::SaveWhenDue(const std::function<std::vector<json>()>& latest) {
  if (!context_.checkpoints().WantsSave()) return;
  const fs::path file = FileOf("save");
  file_.flush();
  fs::copy_file(FileOf("records"), file, fs::copy_options::overwrite_existing);
  {
    std::ofstream out(file, std::ios::binary | std::ios::app);
    if (latest) {
      for (const json& record : latest()) Write(record, out);
    }
    if (!file_ || !out.flush()) {
      throw Error(ErrorCode::kResourceExhausted,
                  "cannot write the checkpoint {}; is the disk full?",
                  file.string());
    }
  }
  context_.checkpoints().SaveFile(file);
}

fs::path RecordCheckpoint::FileOf(const char* name) const {
  return context_.scratch_folder() / fmt::format("{}_checkpoint.{}", stage_, name);
}

}  // namespace color3d
