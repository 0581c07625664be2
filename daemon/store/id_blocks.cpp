#include "daemon/store/id_blocks.hpp"

#include <bit>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include "daemon/store/line_text.hpp"

namespace axisd::store {
namespace {

static_assert(std::endian::native == std::endian::little);

template <class T>
void put(std::string& to, const T& value) {
  to.append(reinterpret_cast<const char*>(&value), sizeof value);
}
void put_text(std::string& to, std::string_view text) {
  put(to, static_cast<std::uint32_t>(text.size()));
  to += text;
}

/// After the first mismatch everything fails.
class Reader {
 public:
  explicit Reader(std::string_view rest) : rest_(rest) {}
  [[nodiscard]] std::size_t left() const { return rest_.size(); }
  template <class T>
  bool get(T& value) {
    std::string_view bytes;
    if (!take(sizeof value, bytes)) return false;
    bytes.copy(reinterpret_cast<char*>(&value), sizeof value);
    return true;
  }
  bool text(std::string& value) {
    std::uint32_t size = 0;
    std::string_view bytes;
    if (!get(size) || !take(size, bytes)) return false;
    value = bytes;
    return true;
  }
  bool take(std::size_t size, std::string_view& bytes) {
    if (size > rest_.size()) return false;
    bytes = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return true;
  }

 private:
  std::string_view rest_;
};

bool read_run(Reader& reader, ClientRun& read) {
  auto& run = read.run;
  std::int64_t begin = 0;
  std::int64_t newest = 0;
  std::uint32_t count = 0;
  std::string_view records;
  if (!reader.text(read.client) || !reader.text(run.instance) || !reader.get(run.last_number) ||
      !reader.get(begin) || !reader.get(newest) || !reader.get(count) ||
      !reader.take(count * sizeof(IdRecord), records))
    return false;
  run.begin = TimePoint(Duration(begin));
  run.newest = TimePoint(Duration(newest));
  run.records.resize(count);
  records.copy(reinterpret_cast<char*>(run.records.data()), records.size());
  return true;
}

}  // namespace

std::string encode_ids(const std::vector<ClientRun>& runs) {
  std::string body;
  for (const auto& [client, run] : runs) {
    put_text(body, client);
    put_text(body, run.instance);
    put(body, run.last_number);
    put(body, std::int64_t{run.begin.time_since_epoch().count()});
    put(body, std::int64_t{run.newest.time_since_epoch().count()});
    put(body, static_cast<std::uint32_t>(run.records.size()));
    if (!run.records.empty())
      body.append(reinterpret_cast<const char*>(run.records.data()), run.records.size() * sizeof(IdRecord));
  }
  std::string block;
  block.reserve(2 * sizeof(std::uint32_t) + body.size());
  put(block, static_cast<std::uint32_t>(body.size()));
  put(block, crc32(body));
  return block + body;
}

IdBlocks decode_ids(std::string_view bytes) {
  IdBlocks blocks;
  Reader reader(bytes);
  while (reader.left() > 0) {
    std::uint32_t size = 0;
    std::uint32_t checksum = 0;
    std::string_view body;
    if (!reader.get(size) || !reader.get(checksum) || !reader.take(size, body) || crc32(body) != checksum)
      break;
    Reader inside(body);
    const auto before = blocks.runs.size();
    bool whole = true;
    while (whole && inside.left() > 0) whole = read_run(inside, blocks.runs.emplace_back());
    if (!whole) {
      blocks.runs.resize(before);
      break;
    }
    blocks.good = bytes.size() - reader.left();
  }
  return blocks;
}

}  // namespace axisd::store
