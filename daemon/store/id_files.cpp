#include "daemon/store/id_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "daemon/store/id_blocks.hpp"

namespace axisd::store {
namespace {

/// A file is removed as a whole, so none is large, or about much time.
constexpr std::uint64_t largest_file = std::uint64_t{1} << 20U;
constexpr Duration longest_file = std::chrono::minutes(5);

}  // namespace

Result<IdsLine> append_ids(JournalDisk& disk, const std::vector<IdsLine>& files,
                           const std::vector<ClientRun>& runs) {
  IdsLine added{
      .file = files.empty() ? 1 : files.back().file + 1, .begin = Duration::max(), .newest = Duration::min()};
  for (const auto& [client, run] : runs) {
    added.count += run.records.size();
    added.begin = std::min(added.begin, run.begin.time_since_epoch());
    added.newest = std::max(added.newest, run.newest.time_since_epoch());
  }
  if (!files.empty() && files.back().bytes < largest_file &&
      added.newest - files.back().begin <= longest_file) {
    const auto& last = files.back();
    added.file = last.file;
    added.bytes = last.bytes;
    added.count += last.count;
    added.begin = std::min(added.begin, last.begin);
    added.newest = std::max(added.newest, last.newest);
  }
  const auto block = encode_ids(runs);
  if (auto written = disk.append_ids(added.file, added.bytes, block); !written) return fail(written.error());
  added.bytes += block.size();
  return added;
}

std::vector<IdsLine> still_needed(std::vector<IdsLine> files, Duration now, const IdBounds& bounds) {
  std::size_t newer = 0;
  std::ranges::reverse(files);
  std::erase_if(files, [&](const IdsLine& file) {
    const bool over = file.newest < now - remembered ||
                      (newer + file.count > bounds.most && file.newest < now - remembered_at_least);
    if (!over) newer += file.count;
    return over;
  });
  std::ranges::reverse(files);
  return files;
}

Result<IdsLoad> load_ids(JournalDisk& disk, const std::vector<IdsLine>& files) {
  IdsLoad load;
  for (auto file : files) {
    const auto bytes = disk.read_ids(file.file, file.bytes);
    if (!bytes) return fail(bytes.error());
    auto blocks = decode_ids(*bytes);
    if (blocks.good < file.bytes) {
      if (load.damage.empty())
        load.damage =
            fmt::format("file {} of ids is damaged behind byte {} of {}", file.file, blocks.good, file.bytes);
      file.bytes = blocks.good;
    }
    load.files.push_back(file);
    std::ranges::move(blocks.runs, std::back_inserter(load.runs));
  }
  return load;
}

}  // namespace axisd::store
