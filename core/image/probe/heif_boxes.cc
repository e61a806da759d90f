#include "core/image/probe/heif_boxes.h"

#include <utility>

namespace color3d::probe_internal {
namespace {

constexpr size_t kMaxEntries = 65'536;  // of each list, against lists that repeat themselves

// Reads one field after another; the end of the bytes is the end of the box.
class Fields {
 public:
  Fields(const ProbeContext& context, std::string_view bytes)
      : context_(context), bytes_(bytes), reader_(bytes) {}

  // `count` bytes, 0..8, most significant first.
  uint64_t Take(size_t count) {
    if (!reader_.Has(at_, count)) throw context_.Damaged("a box ends inside a field");
    uint64_t value = 0;
    for (size_t i = 0; i < count; ++i) value = value << 8 | reader_.U8(at_ + i);
    at_ += count;
    return value;
  }
  uint32_t Take32(size_t count) { return static_cast<uint32_t>(Take(count)); }
  std::string_view TakeText(size_t count) {
    if (!reader_.Has(at_, count)) throw context_.Damaged("a box ends inside a field");
    at_ += count;
    return bytes_.substr(at_ - count, count);
  }
  std::string_view Rest() const { return bytes_.substr(at_); }

 private:
  const ProbeContext& context_;
  const std::string_view bytes_;
  const ByteReader reader_;
  size_t at_ = 0;
};

struct Box {
  std::string_view type;
  std::string_view body;
};

// The boxes in `bytes`, in order. `is_file`: data that ends too early means a truncated file.
std::vector<Box> ListBoxes(const ProbeContext& context, std::string_view bytes, bool is_file) {
  const ByteReader reader(bytes);
  std::vector<Box> boxes;
  size_t at = 0;
  while (at < bytes.size() && boxes.size() < kMaxEntries) {
    if (!reader.Has(at, 8)) {
      if (is_file && !boxes.empty()) break;  // a few trailing bytes
      throw context.Truncated("it ends inside a box");
    }
    uint64_t size = reader.U32(at);
    size_t header = 8;
    if (size == 1) {
      size = uint64_t{reader.U32(at + 8)} << 32 | reader.U32(at + 12);
      header = 16;
    }
    if (size == 0) size = bytes.size() - at;  // up to the end
    if (size < header) throw context.Damaged("a box is smaller than its header");
    if (!reader.Has(at, size)) {
      if (!is_file) throw context.Damaged("a box is larger than the one around it");
      // Truncated picture data is detected when its parts are checked.
      if (boxes.empty() || bytes.substr(at + 4, 4) == "meta") {
        throw context.Truncated("it ends inside its header");
      }
      break;
    }
    boxes.push_back({bytes.substr(at + 4, 4), bytes.substr(at + header, size - header)});
    at += size;
  }
  return boxes;
}

class MetaReader {
 public:
  explicit MetaReader(const ProbeContext& context) : context_(context) {}

  HeifBoxes Read(std::string_view meta) {
    Fields full(context_, meta);
    full.Take(4);
    const std::vector<Box> boxes = ListBoxes(context_, full.Rest(), /*is_file=*/false);
    for (const Box& box : boxes) {
      if (box.type == "idat") idat_ = box.body;
    }
    for (const Box& box : boxes) {
      if (box.type == "pitm") ReadPrimary(box.body);
      if (box.type == "iinf") ReadItemKinds(box.body);
      if (box.type == "iloc") ReadPlaces(box.body);
      if (box.type == "iref") ReadReferences(box.body);
      if (box.type == "iprp") ReadProperties(box.body);
    }
    return std::move(found_);
  }

 private:
  void ReadPrimary(std::string_view body) {
    Fields fields(context_, body);
    const uint32_t version = fields.Take32(1);
    fields.Take(3);
    found_.primary = fields.Take32(version == 0 ? 2 : 4);
  }

  void ReadItemKinds(std::string_view body) {
    Fields fields(context_, body);
    const uint32_t version = fields.Take32(1);
    fields.Take(3);
    fields.Take(version == 0 ? 2 : 4);  // how many follow
    for (const Box& box : ListBoxes(context_, fields.Rest(), /*is_file=*/false)) {
      if (box.type != "infe") continue;
      Fields entry(context_, box.body);
      const uint32_t entry_version = entry.Take32(1);
      entry.Take(3);
      if (entry_version < 2) continue;  // items of these versions have no type
      HeifItem& item = found_.items[entry.Take32(entry_version == 2 ? 2 : 4)];
      item.is_protected = entry.Take(2) != 0;
      item.type = entry.TakeText(4);
    }
  }

  void ReadPlaces(std::string_view body) {
    Fields fields(context_, body);
    const uint32_t version = fields.Take32(1);
    fields.Take(3);
    if (version > 2) throw context_.Damaged("its list of places is of an unknown kind");
    const uint32_t sizes = fields.Take32(2);
    const size_t offset_bytes = sizes >> 12 & 15u, length_bytes = sizes >> 8 & 15u;
    const size_t base_bytes = sizes >> 4 & 15u, index_bytes = version == 0 ? 0 : sizes & 15u;
    for (const size_t bytes : {offset_bytes, length_bytes, base_bytes, index_bytes}) {
      if (bytes != 0 && bytes != 4 && bytes != 8) {
        throw context_.Damaged("its list of places has fields of {} bytes", bytes);
      }
    }
    const uint32_t count = fields.Take32(version < 2 ? 2 : 4);
    size_t entries = 0;
    for (uint32_t i = 0; i < count; ++i) {
      HeifItem& item = found_.items[fields.Take32(version < 2 ? 2 : 4)];
      if (version > 0) item.construction = fields.Take32(2) & 15u;
      item.data_reference = fields.Take32(2);
      const uint64_t base = fields.Take(base_bytes);
      const uint32_t parts = fields.Take32(2);
      for (uint32_t k = 0; k < parts; ++k) {
        if (++entries > kMaxEntries) throw context_.Damaged("its list of places is too long");
        fields.Take(index_bytes);
        const uint64_t offset = fields.Take(offset_bytes);
        AddPart(base, offset, fields.Take(length_bytes), &item);
      }
    }
  }

  void AddPart(uint64_t base, uint64_t offset, uint64_t length, HeifItem* item) const {
    if (item->construction > 1 || item->data_reference != 0) return;
    const std::string_view where = item->construction == 1 ? idat_ : context_.bytes;
    const uint64_t at = base + offset;
    if (at < base || at > where.size()) {
      item->is_whole = false;
      return;
    }
    if (length == 0) length = where.size() - at;  // up to the end
    item->is_whole = item->is_whole && length <= where.size() - at;
    item->parts.push_back(where.substr(at, length));
  }

  void ReadReferences(std::string_view body) {
    Fields fields(context_, body);
    const size_t id_bytes = fields.Take(1) == 0 ? 2 : 4;
    fields.Take(3);
    size_t entries = 0;
    for (const Box& box : ListBoxes(context_, fields.Rest(), /*is_file=*/false)) {
      if (box.type != "dimg") continue;
      Fields reference(context_, box.body);
      HeifItem& item = found_.items[reference.Take32(id_bytes)];
      const uint32_t count = reference.Take32(2);
      for (uint32_t i = 0; i < count; ++i) {
        if (++entries > kMaxEntries) throw context_.Damaged("it has too many parts");
        item.made_of.push_back(reference.Take32(id_bytes));
      }
    }
  }

  void ReadProperties(std::string_view body) {
    for (const Box& box : ListBoxes(context_, body, /*is_file=*/false)) {
      if (box.type == "ipco") {
        for (const Box& property : ListBoxes(context_, box.body, /*is_file=*/false)) {
          found_.properties.push_back({property.type, property.body});
        }
      } else if (box.type == "ipma") {
        ReadAssociations(box.body);
      }
    }
  }

  void ReadAssociations(std::string_view body) {
    Fields fields(context_, body);
    const uint32_t version = fields.Take32(1);
    const bool is_wide = (fields.Take(3) & 1u) != 0;
    const uint32_t count = fields.Take32(4);
    for (uint32_t i = 0; i < count; ++i) {
      HeifItem& item = found_.items[fields.Take32(version == 0 ? 2 : 4)];
      const uint32_t associations = fields.Take32(1);
      for (uint32_t k = 0; k < associations; ++k) {
        const uint32_t index = fields.Take32(is_wide ? 2 : 1) & (is_wide ? 0x7FFFu : 0x7Fu);
        if (index > 0) item.properties.push_back(index - 1);
      }
    }
  }

  const ProbeContext& context_;
  HeifBoxes found_;
  std::string_view idat_;
};

}  // namespace

HeifBoxes ReadHeifBoxes(const ProbeContext& context) {
  for (const Box& box : ListBoxes(context, context.bytes, /*is_file=*/true)) {
    if (box.type == "meta") return MetaReader(context).Read(box.body);
  }
  throw context.Truncated("it holds no picture");
}

}  // namespace color3d::probe_internal
