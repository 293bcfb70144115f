#include "batch/align_pairs.hpp"

#include <algorithm>
#include <condition_variable>
#include <exception>
#include <map>
#include <mutex>
#include <new>
#include <optional>
#include <thread>
#include <vector>

#include "cloud_file/cloud_file.hpp"
#include "command.hpp"
#include "no_pose.hpp"
#include "shown_text.hpp"

namespace vnreg::cli {
namespace {

/// Gives out the numbers of rows, and puts the finished rows back into order.
class RowQueue {
 public:
  RowQueue(std::size_t first, std::size_t end, std::size_t window,
           const std::function<void(const ResultRow&)>& sink, const std::atomic<bool>& stop)
      : next_(first), written_(first), end_(end), window_(window), sink_(sink), stop_(stop) {}

  /// The next row to work on; nothing at the end. Waits while a slow row holds up too many others.
  std::optional<std::size_t> take() {
    std::unique_lock lock(mutex_);
    moved_on_.wait(lock, [&] { return failure_ || next_ < written_ + window_; });
    if (failure_ || stop_ || next_ == end_) return std::nullopt;
    return next_++;
  }

  void put(std::size_t number, ResultRow row) {
    const std::scoped_lock lock(mutex_);
    waiting_.emplace(number, std::move(row));
    for (auto first = waiting_.begin(); first != waiting_.end() && first->first == written_;
         first = waiting_.erase(first)) {
      if (!failure_) sink_(first->second);
      ++written_;
    }
    moved_on_.notify_all();
  }

  void fail(const std::exception_ptr& failure) {
    const std::scoped_lock lock(mutex_);
    if (!failure_) failure_ = failure;
    moved_on_.notify_all();
  }

  void rethrow_failure() const {
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  std::mutex mutex_;
  std::condition_variable moved_on_;
  std::map<std::size_t, ResultRow> waiting_;
  std::size_t next_;
  std::size_t written_;
  std::size_t end_;
  std::size_t window_;
  const std::function<void(const ResultRow&)>& sink_;
  const std::atomic<bool>& stop_;
  std::exception_ptr failure_;
};

/// One thread's part: a registrar, and the last target, which many tables repeat.
class PairAligner {
 public:
  explicit PairAligner(const PairsToAlign& work)
      : work_(work), registrar_(make_registrar(work.model, single_threaded(work.options))) {}

  ResultRow row_of(std::size_t number) {
    const Pair& pair = work_.table.pairs[number];
    ResultRow row;
    row.row = static_cast<std::int64_t>(number);
    row.id = shown_text(pair.id);
    row.source = shown_text(pair.source);
    row.target = shown_text(pair.target);
    try {
      align(pair, row);
    } catch (const std::bad_alloc&) {
      row.error = "expected more memory than the machine gives";
    } catch (const std::exception& error) {
      row.error = shown_text(error.what());
    }
    return row;
  }

 private:
  static Options single_threaded(Options options) {
    options.threads = 1;
    return options;
  }

  void align(const Pair& pair, ResultRow& row) {
    const std::string source_path = work_.table.path_of(pair.source);
    const std::string target_path = work_.table.path_of(pair.target);
    const cloud_file::Points source = cloud_file::read_cloud(source_path);
    if (target_path != last_target_path_) {
      last_target_path_.clear();
      last_target_ = cloud_file::read_cloud(target_path);
      last_target_path_ = target_path;
    }
    const Result& result = registrar_.align(source, last_target_);
    set_result(row, result);
    if (result.has_pose) return;
    row.error = shown_text(why_no_pose(result, {source_path, source}, {target_path, last_target_},
                                       work_.model.min_points()));
  }

  const PairsToAlign& work_;
  Registrar registrar_;
  std::string last_target_path_;
  cloud_file::Points last_target_;
};

void work_on(const PairsToAlign& work, RowQueue& queue) {
  try {
    PairAligner aligner(work);
    while (const auto number = queue.take()) queue.put(*number, aligner.row_of(*number));
  } catch (...) {
    queue.fail(std::current_exception());
  }
}

std::size_t thread_count(const PairsToAlign& work) {
  const auto asked = static_cast<std::size_t>(work.threads);
  const std::size_t threads = asked > 0 ? asked : std::thread::hardware_concurrency();
  return std::clamp<std::size_t>(threads, 1, std::max<std::size_t>(work.table.pairs.size(), 1));
}

}  // namespace

void align_pairs(const PairsToAlign& work, const std::function<void(const ResultRow&)>& sink,
                 const std::atomic<bool>& stop) {
  const std::size_t threads = thread_count(work);
  RowQueue queue(work.first, work.table.pairs.size(), 64 * threads, sink, stop);
  std::vector<std::jthread> others;
  try {
    for (std::size_t i = 1; i < threads; ++i) others.emplace_back([&] { work_on(work, queue); });
  } catch (...) {
    queue.fail(std::current_exception());
  }
  work_on(work, queue);
  others.clear();
  queue.rethrow_failure();
}

}  // namespace vnreg::cli
