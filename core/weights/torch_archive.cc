#include "core/weights/torch_archive.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/weights/element_type.h"
#include "core/weights/pickle.h"
#include "core/zip/zip.h"

namespace color3d {
namespace {

using Kind = PickleValue::Kind;

constexpr uint64_t kMaxPickleBytes = 64'000'000;
constexpr int kMaxDepth = 64;           // nesting of modules
constexpr size_t kMaxNameBytes = 1024;  // length of an attribute path
constexpr uint64_t kSpareElements = 1 << 16;
constexpr uint64_t kSpareForName = 32;  // size of a node of the map, in floats
constexpr size_t kMaxVisits =
    100'000;  // bounds graphs with shared modules, which can have 2^64 paths

// Returns the last element of a view plus one, relative to its first; 0 if it is empty, and more
// than 2^62 on overflow.
int64_t SpanOf(const PickleTensor& tensor) {
  constexpr __int128 kMaxSpan = __int128{1} << 62;
  __int128 last = 0;
  for (size_t i = 0; i < tensor.shape.size(); ++i) {
    if (tensor.shape[i] == 0) return 0;
    last += static_cast<__int128>(tensor.shape[i] - 1) * tensor.strides[i];
    if (last >= kMaxSpan) return static_cast<int64_t>(kMaxSpan);
  }
  return static_cast<int64_t>(last) + 1;
}

bool IsContiguous(const PickleTensor& tensor) {
  int64_t expected = 1;
  for (size_t i = tensor.shape.size(); i-- > 0;) {
    if (tensor.shape[i] != 1 && tensor.strides[i] != expected) return false;
    expected *= tensor.shape[i];
  }
  return true;
}

// Returns a row-major copy of the view that starts at storage[0].
std::vector<float> Gather(const std::vector<float>& storage,
                          const PickleTensor& tensor,
                          int64_t count) {
  std::vector<float> values(static_cast<size_t>(count));
  std::vector<int64_t> index(tensor.shape.size(), 0);
  int64_t at = 0;
  for (float& value : values) {
    value = storage[static_cast<size_t>(at)];
    for (size_t i = index.size(); i-- > 0;) {
      at += tensor.strides[i];
      if (++index[i] < tensor.shape[i]) break;
      at -= tensor.strides[i] * tensor.shape[i];
      index[i] = 0;
    }
  }
  return values;
}

class ArchiveReader {
 public:
  explicit ArchiveReader(const ByteSource& source) : source_(source), zip_(source) {
    FindStem();
    const ZipRecord* order = FindStored("byteorder");
    if (order && source.ReadString(order->offset, std::min<uint64_t>(order->size, 3)) == "big") {
      throw source.Refusal("it was written on a big-endian machine; save it again on another");
    }
    const ZipRecord& pickle = *FindStored("data.pkl");
    if (pickle.size > kMaxPickleBytes) {
      throw source.Refusal("its data.pkl has {} bytes, far more than a state dict needs",
                           pickle.size);
    }
    pickle_ = source.ReadString(pickle.offset, pickle.size);
    graph_ = ReadPickle(pickle_, source, is_script_);
    budget_ = 8 * source.size() / sizeof(float) + kSpareElements;
  }

  WeightMap Read() {
    if (is_script_) {
      ReadModule(graph_.root, "", 0);
    } else {
      ReadStateDict();
    }
    if (weights_.empty()) {
      throw source_.Refusal("there are no tensors in it; save the model's state dict");
    }
    return std::move(weights_);
  }

 private:
  void FindStem() {
    for (const auto& [name, record] : zip_.records()) {
      const size_t slash = name.find('/');
      if (slash == std::string::npos || name.substr(slash) != "/data.pkl") continue;
      if (!stem_.empty()) throw source_.Refusal("it has more than one data.pkl");
      stem_ = name.substr(0, slash + 1);
    }
    if (stem_.empty()) {
      throw source_.Refusal(
          "a zip archive without data.pkl: neither a PyTorch state dict nor "
          "TorchScript");
    }
    const auto code = zip_.records().lower_bound(stem_ + "code/");
    is_script_ = zip_.Find(stem_ + "constants.pkl") != nullptr ||
                 (code != zip_.records().end() && code->first.starts_with(stem_ + "code/"));
  }

  // Returns the record of that name below the stem, or nullptr. Its bytes are read in place, and
  // checksums are not verified, since PyTorch may omit them.
  const ZipRecord* FindStored(const std::string& name) const {
    const ZipRecord* record = zip_.Find(stem_ + name);
    if (record && record->method != 0) {
      throw source_.Refusal(
          "the record {} is compressed, which PyTorch never does; pack the archive again with "
          "stored records (zip -0)",
          QuotedName(stem_ + name));
    }
    return record;
  }

  void ReadStateDict() {
    const PickleValue* dict = &graph_.values[graph_.root];
    // Training programs store the state dict under their own key, sometimes two levels deep.
    for (int level = 0; level < 3; ++level) {
      const PickleValue* inner = nullptr;
      for (std::string_view key : {"params_ema", "params", "state_dict", "model", "module"}) {
        const PickleValue* found = graph_.Find(*dict, key);
        if (!inner && found && found->kind == Kind::kDict) inner = found;
      }
      if (!inner) break;
      dict = inner;
    }
    if (dict->kind != Kind::kDict) throw source_.Refusal("it does not hold a state dict");
    for (size_t i = 0; i + 1 < dict->items.size(); i += 2) {
      const PickleValue& name = graph_.values[dict->items[i]];
      const PickleValue& value = graph_.values[dict->items[i + 1]];
      if (name.kind == Kind::kText && value.kind == Kind::kTensor) {
        AddTensor(std::string(name.text), value);
      }
    }
  }

  // Collects tensors of a TorchScript module and visits its submodules.
  void ReadModule(uint32_t index, const std::string& prefix, int depth) {
    const PickleValue& module = graph_.values[index];
    if (module.kind != Kind::kObject || module.items.empty()) return;
    const PickleValue& state = graph_.values[module.items[0]];
    if (state.kind != Kind::kDict) return;
    if (depth > kMaxDepth) throw source_.Refusal("its modules are nested too deeply");
    for (size_t i = 0; i + 1 < state.items.size(); i += 2) {
      if (++visits_ > kMaxVisits) throw source_.Refusal("its modules have too many attributes");
      const PickleValue& name = graph_.values[state.items[i]];
      const PickleValue& value = graph_.values[state.items[i + 1]];
      if (name.kind != Kind::kText) continue;
      if (prefix.size() + name.text.size() > kMaxNameBytes) {
        throw source_.Refusal("an attribute name in it has more than 1024 characters");
      }
      if (value.kind == Kind::kTensor) {
        AddTensor(prefix + std::string(name.text), value);
      } else if (value.kind == Kind::kObject) {
        ReadModule(state.items[i + 1], prefix + std::string(name.text) + ".", depth + 1);
      }
    }
  }

  void AddTensor(const std::string& name, const PickleValue& value) {
    Spend(kSpareForName + name.size() / sizeof(float));
    const auto [at, fresh] = weights_.try_emplace(name);
    if (!fresh) throw source_.Refusal("{} is there twice", QuotedName(name));
    const PickleTensor& tensor = graph_.tensors[static_cast<size_t>(value.number)];
    const PickleStorage& storage = graph_.storages[tensor.storage];
    at->second.values = ReadTensor(name, tensor, storage);
    at->second.shape = tensor.shape;
  }

  std::vector<float> ReadTensor(const std::string& name,
                                const PickleTensor& tensor,
                                const PickleStorage& storage) {
    const ZipRecord* record = FindStored("data/" + std::string(storage.key));
    if (!record) {
      throw source_.Refusal(
          "the data of {} (record {}) are missing", QuotedName(name), QuotedName(storage.key));
    }
    const auto bytes = static_cast<uint64_t>(ElementBytes(storage.type));
    const uint64_t there = std::min(static_cast<uint64_t>(storage.count), record->size / bytes);
    const int64_t count = CheckedElementCount(source_, name, tensor.shape);
    const auto span = static_cast<uint64_t>(SpanOf(tensor));
    if (span > there || static_cast<uint64_t>(tensor.offset) > there - span) {
      throw source_.Refusal(
          "{} reaches beyond the {} elements of its storage", QuotedName(name), there);
    }
    const bool contiguous = IsContiguous(tensor);
    Spend(static_cast<uint64_t>(count) + (contiguous ? 0 : span));
    std::vector<float> values = ReadElements(
        source_, record->offset + static_cast<uint64_t>(tensor.offset) * bytes, storage.type, span);
    if (contiguous) return values;
    return Gather(values, tensor, count);
  }

  // Bounds the memory of repeated views and of views that repeat elements.
  void Spend(uint64_t elements) {
    if (elements > budget_) {
      throw source_.Refusal("its tensors would take more than 8 times the file's size");
    }
    budget_ -= elements;
  }

  const ByteSource& source_;
  ZipReader zip_;
  std::string stem_;  // ends in '/'
  bool is_script_ = false;
  std::string pickle_;
  PickleGraph graph_;
  uint64_t budget_ = 0;  // remaining elements to read
  size_t visits_ = 0;
  WeightMap weights_;
};

}  // namespace

WeightMap ReadTorchArchive(const ByteSource& source) { return ArchiveReader(source).Read(); }

}  // namespace color3d
