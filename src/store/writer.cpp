#include "spindle/store/writer.hpp"

#include <filesystem>
#include <mutex>
#include <utility>

#include "store/connection.hpp"
#include "store/folder.hpp"
#include "store/journal.hpp"
#include "store/lock.hpp"
#include "store/schema.hpp"
#include "store/trim.hpp"

namespace spindle::store {
namespace {

/// From so many pages on the write-ahead log is copied into the database, and from so many on it
/// is also emptied where no reader needs it.
constexpr int pages_to_copy = 1'000;
constexpr int pages_to_empty = 8'192;

class FileWriter : public Writer {
 public:
  FileWriter(WriterLock lock, std::unique_ptr<Connection> connection)
      : lock_(std::move(lock)), connection_(std::move(connection)), journal_(*connection_) {
    sqlite3_wal_hook(connection_->handle(), note_pages, this);
  }

  Result<RowId> tool(const ToolName& name, const std::string& model) override {
    return transaction([&] { return journal_.tool(name, model); });
  }
  Result<bool> has_tool(const ToolName& name) override {
    return reading([&] { return journal_.has_tool(name); });
  }
  Result<RowId> place(const Place& place) override {
    return transaction([&] { return journal_.place(place); });
  }
  Result<std::optional<Last>> last(RowId tool) override {
    return reading([&] { return journal_.last(tool); });
  }

  Result<void> adopt(RowId tool, const Last& last) override {
    TRY(transaction([&] {
      journal_.adopt(tool, last);
      return true;
    }));
    return {};
  }

  Result<std::vector<Stored>> commit(std::span<const Entry> entries) override {
    return transaction([&] {
      std::vector<Stored> stored;
      stored.reserve(entries.size());
      for (const Entry& entry : entries) {
        stored.push_back(std::visit(
            [&](const auto& alternative) { return journal_.store(alternative); }, entry));
      }
      return stored;
    });
  }

  Result<Trimmed> trim(WallTime before, WallTime now) override {
    TRY_LET(auto trimmed, transaction([&] { return store::trim(*connection_, before, now); }));
    return trimmed;
  }

 private:
  static int note_pages(void* self, sqlite3* /*handle*/, const char* /*name*/, int pages) {
    static_cast<FileWriter*>(self)->pages_ = pages;
    return SQLITE_OK;
  }

  template <typename Value>
  static bool is_refused(const Result<Value>& result) {
    return !result.has_value();
  }
  template <typename Value>
  static bool is_refused(const Value& /*value*/) {
    return false;
  }

  /// Waits for no other program that writes.
  template <typename Work>
  auto reading(const Work& work) -> Result<decltype(work())> {
    const std::lock_guard guard(mutex_);
    connection_->run("BEGIN");
    auto result = work();
    TRY(connection_->end_transaction());
    return result;
  }

  template <typename Work>
  auto transaction(const Work& work) -> Result<decltype(work())> {
    const std::lock_guard guard(mutex_);
    connection_->run("BEGIN IMMEDIATE");
    auto result = work();
    if (is_refused(result)) {
      connection_->roll_back();
      TRY(connection_->outcome());
      return result;
    }
    TRY(connection_->end_transaction());
    copy_log();
    return result;
  }

  /// What is committed is safe in the write-ahead log; that this fails is no failure of a commit,
  /// and it is tried again at the next one.
  void copy_log() {
    if (pages_ < pages_to_copy) return;
    sqlite3* handle = connection_->handle();
    // A long reader must not keep the writer waiting.
    sqlite3_busy_timeout(handle, 0);
    const int mode =
        pages_ < pages_to_empty ? SQLITE_CHECKPOINT_PASSIVE : SQLITE_CHECKPOINT_TRUNCATE;
    sqlite3_wal_checkpoint_v2(handle, nullptr, mode, nullptr, nullptr);
    sqlite3_busy_timeout(handle, longest_wait_ms);
    pages_ = 0;
  }

  std::mutex mutex_;
  WriterLock lock_;  ///< held until the connection is closed
  std::unique_ptr<Connection> connection_;
  int pages_ = 0;  ///< of the write-ahead log, as of the last commit
  Journal journal_;
};

Result<std::unique_ptr<Connection>> open_database(const std::string& path) {
  TRY_LET(const auto found, examine(path));
  if (found == Found::nothing) {
    const auto made = make_own_file(path, Errc::usage);
    // Nothing was stored in one that is there, or SQLite can still undo what was begun.
    if (!made && made.error().code != Errc::usage) return tl::unexpected(made.error());
  }
  auto connection = Connection::open(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, path);
  if (!connection) return tl::unexpected(connection.error());
  TRY(check_open(**connection));
  for (const auto& step : {migrate, set_durable}) {
    TRY(step(**connection));
  }
  return connection;
}

}  // namespace

Result<std::unique_ptr<Writer>> Writer::open(const std::string& path) {
  const std::string whole = std::filesystem::absolute(path).lexically_normal().string();
  TRY(prepare_folder(whole));
  TRY_LET(auto lock, WriterLock::take(whole));
  TRY_LET(auto connection, open_database(whole));
  Connection& opened = *connection;
  auto writer = std::make_unique<FileWriter>(std::move(lock), std::move(connection));
  TRY(opened.outcome());
  return writer;
}

}  // namespace spindle::store
