#include "tests/support/networks/weight_files.h"

#include <bit>
#include <cstring>

#include "core/weights/element_type.h"

namespace color3d {
namespace {

template <typename Number>
void Put(std::string& bytes, Number value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

std::string Zip64Extra(uint64_t size, uint64_t offset) {
  std::string extra;
  Put<uint16_t>(extra, 1);
  Put<uint16_t>(extra, 24);
  Put(extra, size);
  Put(extra, size);
  Put(extra, offset);
  return extra;
}

// The part that local header and directory share, from "version needed" to the extra's length.
void PutCommon(std::string& bytes, const ZipItem& item, bool zip64, uint64_t extra_bytes) {
  const auto size = zip64 ? 0xffffffffu : static_cast<uint32_t>(item.content.size());
  Put<uint16_t>(bytes, zip64 ? 45 : 20);
  Put<uint16_t>(bytes, 0);  // flags
  Put(bytes, item.method);
  Put<uint32_t>(bytes, 0);  // time and date
  Put<uint32_t>(bytes, 0);  // checksum: left out
  Put(bytes, size);
  Put(bytes, size);
  Put<uint16_t>(bytes, static_cast<uint16_t>(item.name.size()));
  Put<uint16_t>(bytes, static_cast<uint16_t>(extra_bytes));
}

void PutEnd(std::string& bytes, uint64_t begin, uint64_t count, bool zip64) {
  const uint64_t end = bytes.size();
  if (zip64) {
    Put<uint32_t>(bytes, 0x06064b50);
    Put<uint64_t>(bytes, 44);
    Put<uint16_t>(bytes, 45);
    Put<uint16_t>(bytes, 45);
    Put<uint64_t>(bytes, 0);
    Put(bytes, count);
    Put(bytes, count);
    Put(bytes, end - begin);
    Put(bytes, begin);
    Put<uint32_t>(bytes, 0x07064b50);
    Put<uint32_t>(bytes, 0);
    Put(bytes, end);
    Put<uint32_t>(bytes, 1);
  }
  Put<uint32_t>(bytes, 0x06054b50);
  Put<uint32_t>(bytes, 0);
  Put<uint16_t>(bytes, zip64 ? 0xffff : static_cast<uint16_t>(count));
  Put<uint16_t>(bytes, zip64 ? 0xffff : static_cast<uint16_t>(count));
  Put<uint32_t>(bytes, zip64 ? 0xffffffff : static_cast<uint32_t>(end - begin));
  Put<uint32_t>(bytes, zip64 ? 0xffffffff : static_cast<uint32_t>(begin));
  Put<uint16_t>(bytes, 0);
}

std::string StoredBytes(const std::vector<float>& values, const std::string& storage_type) {
  std::string bytes;
  if (storage_type == "FloatStorage") {
    bytes.assign(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
    return bytes;
  }
  for (float value : values) {
    if (storage_type == "HalfStorage") Put(bytes, HalfFromFloat(value));
    if (storage_type == "BFloat16Storage") {
      Put(bytes, static_cast<uint16_t>(std::bit_cast<uint32_t>(value) >> 16));
    }
    if (storage_type == "DoubleStorage") Put(bytes, static_cast<double>(value));
    if (storage_type == "LongStorage") Put(bytes, static_cast<int64_t>(value));
  }
  return bytes;
}

}  // namespace

std::string MakeZip(const std::vector<ZipItem>& items, const ZipLayout& layout) {
  uint64_t total = 0;
  for (const ZipItem& item : items) total += item.content.size() + 2 * item.name.size() + 256;
  std::string bytes;
  bytes.reserve(total);
  std::vector<uint64_t> offsets;
  for (const ZipItem& item : items) {
    offsets.push_back(bytes.size());
    std::string extra = layout.zip64 ? Zip64Extra(item.content.size(), 0) : "";
    const uint64_t content = bytes.size() + 30 + item.name.size() + extra.size() + 4;
    const uint64_t padding = (layout.alignment - content % layout.alignment) % layout.alignment;
    extra += "FB";
    Put(extra, static_cast<uint16_t>(padding));
    extra.append(padding, 'Z');
    Put<uint32_t>(bytes, 0x04034b50);
    PutCommon(bytes, item, layout.zip64, extra.size());
    bytes += item.name + extra;
    bytes += item.content;
  }
  const uint64_t begin = bytes.size();
  for (size_t i = 0; i < items.size(); ++i) {
    const std::string extra =
        layout.zip64 ? Zip64Extra(items[i].content.size(), offsets[i]) : std::string();
    Put<uint32_t>(bytes, 0x02014b50);
    Put<uint16_t>(bytes, 0);
    PutCommon(bytes, items[i], layout.zip64, extra.size());
    Put<uint16_t>(bytes, 0);  // comment
    Put<uint16_t>(bytes, 0);  // disk
    Put<uint16_t>(bytes, 0);
    Put<uint32_t>(bytes, 0);
    Put(bytes, layout.zip64 ? 0xffffffffu : static_cast<uint32_t>(offsets[i]));
    bytes += items[i].name + extra;
  }
  PutEnd(bytes, begin, items.size(), layout.zip64);
  return bytes;
}

PickleWriter& PickleWriter::Op(char opcode) {
  bytes_ += opcode;
  return *this;
}

PickleWriter& PickleWriter::Raw(std::string_view bytes) {
  bytes_ += bytes;
  return *this;
}

PickleWriter& PickleWriter::Global(const std::string& module, const std::string& name) {
  bytes_ += "c" + module + "\n" + name + "\n";
  return *this;
}

PickleWriter& PickleWriter::Text(std::string_view text) {
  bytes_ += 'X';
  Put(bytes_, static_cast<uint32_t>(text.size()));
  bytes_ += text;
  return *this;
}

PickleWriter& PickleWriter::Int(int64_t value) {
  if (value >= 0 && value < 256) {
    bytes_ += 'K';
    bytes_ += static_cast<char>(value);
  } else if (value == static_cast<int32_t>(value)) {
    bytes_ += 'J';
    Put(bytes_, static_cast<int32_t>(value));
  } else {
    bytes_ += "\x8a\x08";
    Put(bytes_, value);
  }
  return *this;
}

PickleWriter& PickleWriter::IntTuple(const std::vector<int64_t>& values) {
  Op('(');
  for (int64_t value : values) Int(value);
  return Op('t');
}

PickleWriter& PickleWriter::Tensor(const std::string& storage_type,
                                   const std::string& key,
                                   int64_t count,
                                   int64_t offset,
                                   const std::vector<int64_t>& shape,
                                   const std::vector<int64_t>& strides) {
  Global("torch._utils", "_rebuild_tensor_v2").Op('(').Op('(').Text("storage");
  Global("torch", storage_type).Text(key).Text("cuda:0").Int(count).Op('t').Op('Q');
  Int(offset).IntTuple(shape).IntTuple(strides).Op('\x89');
  return Global("collections", "OrderedDict").Op(')').Op('R').Op('t').Op('R');
}

std::vector<int64_t> ContiguousStrides(const std::vector<int64_t>& shape) {
  std::vector<int64_t> strides(shape.size(), 1);
  for (size_t i = shape.size(); i-- > 1;) strides[i - 1] = strides[i] * shape[i];
  return strides;
}

std::string MakeStateDict(const WeightMap& weights, const StateDictLayout& layout) {
  PickleWriter pickle;
  std::vector<ZipItem> items{{"model/data.pkl", ""}};
  if (!layout.wrapper.empty()) pickle.Op('}').Text(layout.wrapper);
  pickle.Global("collections", "OrderedDict").Op(')').Op('R').Op('(');
  int key = 0;
  for (const auto& [name, array] : weights) {
    const std::string record = std::to_string(key++);
    pickle.Text(name).Tensor(layout.storage_type,
                             record,
                             static_cast<int64_t>(array.values.size()),
                             0,
                             array.shape,
                             ContiguousStrides(array.shape));
    items.push_back({"model/data/" + record, StoredBytes(array.values, layout.storage_type)});
  }
  pickle.Op('u');
  if (layout.with_metadata) {
    pickle.Op('}').Text("_metadata").Op('}').Op('s').Op('b');
  }
  if (!layout.wrapper.empty()) pickle.Op('s');
  items[0].content = pickle.Finish();
  items.push_back({"model/version", "3\n"});
  return MakeZip(items);
}

}  // namespace color3d
