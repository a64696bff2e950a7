// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/run_log_store.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

namespace dual_proxy {
namespace {

using Eigen::Index;

std::string TemporaryDirectory() {
  const char* chosen = std::getenv("TMPDIR");
  if (chosen && *chosen) return chosen;
  // /tmp may be in memory, which is what the file is to spare.
  return ::access("/var/tmp", W_OK) == 0 ? "/var/tmp" : "/tmp";
}

[[noreturn]] void ThrowSystemError(int error, const std::string& what) {
  throw std::system_error(error, std::generic_category(), what);
}

/** A file of `num_bytes` without a name. */
int MakeFile(std::size_t num_bytes) {
  const std::string directory = TemporaryDirectory();
  std::string path = directory + "/dual_proxy_log_XXXXXX";
  const int file = ::mkostemp(path.data(), O_CLOEXEC);
  int error = file < 0 ? errno : 0;
  if (file >= 0) {
    ::unlink(path.c_str());
    error = ::posix_fallocate(file, 0, static_cast<off_t>(num_bytes));
    if (error != 0) ::close(file);
  }
  if (error != 0) {
    ThrowSystemError(error, "a log of " + std::to_string(num_bytes >> 20) +
                                " MB in " + directory +
                                " (TMPDIR names another folder)");
  }
  return file;
}

}  // namespace

RunLogStore::RunLogStore(int num_columns, Index capacity)
    : num_columns_(num_columns), capacity_(capacity) {
  if (num_columns < 0 || capacity < 0) {
    throw std::invalid_argument(
        "RunLogStore: `num_columns` and `capacity` expected >= 0, got " +
        std::to_string(num_columns) + " and " + std::to_string(capacity));
  }
  // One row at least, as nothing cannot be mapped.
  num_bytes_ = sizeof(double) * (1 + static_cast<std::size_t>(num_columns)) *
               static_cast<std::size_t>(std::max<Index>(capacity, 1));
  const bool in_memory = num_bytes_ <= kMostInMemory;
  if (!in_memory) file_ = MakeFile(num_bytes_);
  void* data =
      in_memory ? ::mmap(nullptr, num_bytes_, PROT_READ | PROT_WRITE,
                         MAP_PRIVATE | MAP_ANONYMOUS, -1, 0)
                : ::mmap(nullptr, num_bytes_, PROT_READ, MAP_SHARED, file_, 0);
  if (data == MAP_FAILED) {
    const int error = errno;
    if (file_ >= 0) ::close(file_);
    ThrowSystemError(error, "a log of " + std::to_string(num_bytes_ >> 20) +
                                " MB cannot be mapped");
  }
  // A page fault for each 4 kB would take a tenth of a fast run's time.
  if (in_memory) ::madvise(data, num_bytes_, MADV_HUGEPAGE);
  data_ = static_cast<double*>(data);
}

RunLogStore::~RunLogStore() {
  ::munmap(data_, num_bytes_);
  if (file_ >= 0) ::close(file_);
}

void RunLogStore::Append(const Eigen::Ref<const Eigen::VectorXd>& times,
                         const Eigen::Ref<const Eigen::MatrixXd>& samples) {
  if (samples.rows() != num_columns_ || samples.cols() != times.size()) {
    throw std::invalid_argument("RunLogStore: `samples` expected shape (" +
                                std::to_string(num_columns_) + ", " +
                                std::to_string(times.size()) + "), got (" +
                                std::to_string(samples.rows()) + ", " +
                                std::to_string(samples.cols()) + ")");
  }
  Index old = 0;
  while (old < times.size() && !(times(old) > last_time_)) ++old;
  const Index count = times.size() - old;
  if (count == 0) return;
  for (Index i = old + 1; i < times.size(); ++i) {
    if (!(times(i) > times(i - 1))) {
      throw std::invalid_argument(
          "RunLogStore: `times` expected strictly increasing values, got " +
          std::to_string(times(i)));
    }
  }
  if (num_rows_ + count > capacity_) {
    throw std::invalid_argument("RunLogStore: expected at most " +
                                std::to_string(capacity_) + " rows, got " +
                                std::to_string(num_rows_ + count));
  }
  if (in_memory()) {
    CopyToMemory(times.tail(count), samples.rightCols(count));
  } else {
    buffer_ = times.tail(count);
    Write(0, buffer_);
    for (int i = 0; i < num_columns_; ++i) {
      buffer_ = samples.row(i).tail(count).transpose();
      Write(i + 1, buffer_);
    }
  }
  num_rows_ += count;
  last_time_ = times(times.size() - 1);
}

void RunLogStore::CopyToMemory(
    const Eigen::Ref<const Eigen::VectorXd>& times,
    const Eigen::Ref<const Eigen::MatrixXd>& samples) {
  // As many samples at once as the nearest cache holds.
  constexpr Index kTile = 32;
  double* rows = data_ + num_rows_;
  std::copy(times.begin(), times.end(), rows);
  for (Index begin = 0; begin < times.size(); begin += kTile) {
    const Index end = std::min(begin + kTile, times.size());
    for (int i = 0; i < num_columns_; ++i) {
      double* column = rows + (i + 1) * capacity_;
      for (Index k = begin; k < end; ++k) column[k] = samples(i, k);
    }
  }
}

void RunLogStore::Write(int column, const Eigen::VectorXd& values) {
  const Index start = column * capacity_ + num_rows_;
  const char* bytes = reinterpret_cast<const char*>(values.data());
  std::size_t left = sizeof(double) * static_cast<std::size_t>(values.size());
  auto place = static_cast<off_t>(sizeof(double)) * start;
  while (left > 0) {
    const ssize_t written = ::pwrite(file_, bytes, left, place);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) ThrowSystemError(written < 0 ? errno : ENOSPC, "the log");
    bytes += written;
    left -= static_cast<std::size_t>(written);
    place += written;
  }
}

const double* RunLogStore::column_data(int column) const {
  return data_ + column * capacity_;
}

RunLog::Values<1> RunLogStore::time() const {
  return {column_data(0), num_rows_, 1, Eigen::OuterStride<>(capacity_)};
}

RunLog::Values<> RunLogStore::columns(int start, int size) const {
  return {column_data(1 + start), num_rows_, size,
          Eigen::OuterStride<>(capacity_)};
}

void RunLogStore::Release() const {
  if (!in_memory()) ::madvise(data_, num_bytes_, MADV_DONTNEED);
}

RunLog MakeRunLog(std::shared_ptr<const RunLogStore> store,
                  const std::vector<SignalSlice>& signals) {
  RunLog log;
  log.time = store->time();
  for (const SignalSlice& slice : signals) {
    log.signals.push_back(
        {slice.name, store->columns(slice.start, slice.size)});
  }
  log.release = [&store = *store] { store.Release(); };
  log.storage = std::move(store);
  return log;
}

}  // namespace dual_proxy
