// SPDX-License-Identifier: MIT
#include "eval/store.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "core/text.h"
#include "eval/store_columns.h"

namespace minescan {
namespace {

using Json = nlohmann::json;

// Marks our files among all SQLite files: "mine" in ASCII.
constexpr int application = 0x6d696e65;
// To be raised with every change of the tables below.
constexpr int schema_version = 2;
// Columns of `trials` that files of version 1 lack: what they do not know is NULL, and read as 0.
constexpr auto new_columns =
    std::to_array<std::string_view>({"evaluations", "empty_points", "outside_points"});
// How long to wait for another process that is writing (assumed; a batch takes milliseconds).
constexpr int patience_ms = 10'000;

// SQLite's name for how a value is kept; what is neither number nor text is JSON. Numbers may be
// NULL, as which SQLite keeps NaN.
template <class T>
constexpr const char* storage() {
  if (std::is_floating_point_v<T>) return "REAL";
  return std::is_integral_v<T> ? "INTEGER NOT NULL" : "TEXT NOT NULL";
}

bool is_new(std::string_view column) {
  return std::find(new_columns.begin(), new_columns.end(), column) != new_columns.end();
}

std::string schema() {
  std::string trials;
  Outcome outcome;
  columns(outcome, [&]<class T>(const char* name, const T&) {
    trials += fmt::format("{} {}, ", name, is_new(name) ? "INTEGER" : storage<T>());
  });
  return fmt::format(
      "CREATE TABLE runs (run INTEGER PRIMARY KEY, version TEXT NOT NULL, command_line TEXT NOT "
      "NULL, machine TEXT NOT NULL, threads INTEGER NOT NULL, started TEXT NOT NULL, finished TEXT "
      "NOT NULL);"
      "CREATE TABLE trials (trial_id TEXT NOT NULL, {} run INTEGER NOT NULL REFERENCES runs(run), "
      "PRIMARY KEY (trial_id, study)) WITHOUT ROWID;",
      trials);
}

// "trial_id, study, ..., message, run", as they are selected from a file of that version.
std::string trial_columns(int version = schema_version) {
  std::string names = "trial_id";
  Outcome outcome;
  columns(outcome, [&](const char* name, const auto&) {
    names += fmt::format(", {}{}", version == 1 && is_new(name) ? "NULL AS " : "", name);
  });
  return names + ", run";
}

std::string reason(const SQLite::Exception& error) {
  switch (error.getErrorCode()) {
    case SQLITE_NOTADB:
      return "not a result table (not a SQLite file)";
    case SQLITE_CORRUPT:
      return "damaged or cut short";
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return "in use by another program";
    case SQLITE_READONLY:
      return "cannot be written: read-only file or folder";
    case SQLITE_FULL:
      return "cannot be written: the disk is full";
    case SQLITE_CANTOPEN:
      return "cannot be opened";
    default:
      return error.what();
  }
}

// Row-major, one list per row. JSON has no word for numbers that are not finite: they become null.
template <class Matrix>
std::string matrix_json(const Matrix& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) row.push_back(matrix(i, j));
    rows.push_back(std::move(row));
  }
  return rows.dump();
}

template <class Matrix>
void read_matrix(const std::string& text, Matrix& matrix) {
  const Json rows = Json::parse(text);
  for (Eigen::Index i = 0; i < matrix.rows(); ++i)
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
      const Json& value = rows.at(static_cast<std::size_t>(i)).at(static_cast<std::size_t>(j));
      matrix(i, j) =
          value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
    }
}

// Binds the values of a row one after the other.
struct Binder {
  SQLite::Statement& statement;
  int index = 0;

  void operator()(const char*, const std::string& text) { statement.bind(++index, text); }
  void operator()(const char*, double value) { statement.bind(++index, value); }
  void operator()(const char*, int value) { statement.bind(++index, value); }
  // SQLite's whole numbers are signed: those above 2^63 show as negative, with the same bits.
  void operator()(const char*, std::uint64_t value) {
    statement.bind(++index, static_cast<std::int64_t>(value));
  }
  void operator()(const char*, Status value) { statement.bind(++index, value_text(value)); }
  template <class Value>
  void operator()(const char*, const std::map<std::string, Value>& values) {
    statement.bind(++index, Json(values).dump());
  }
  template <int n>
  void operator()(const char*, const Eigen::Matrix<double, n, n>& matrix) {
    statement.bind(++index, matrix_json(matrix));
  }
};

// Reads them in the same order.
struct Reader {
  SQLite::Statement& statement;
  int index = 0;

  SQLite::Column next() { return statement.getColumn(index++); }
  void operator()(const char*, std::string& text) { text = next().getString(); }
  void operator()(const char*, double& value) {
    const SQLite::Column column = next();
    value = column.isNull() ? std::numeric_limits<double>::quiet_NaN() : column.getDouble();
  }
  void operator()(const char*, int& value) { value = next().getInt(); }
  void operator()(const char*, std::uint64_t& value) {
    value = static_cast<std::uint64_t>(next().getInt64());
  }
  void operator()(const char*, Status& value) { read_value(next().getString(), any_number, value); }
  template <class Value>
  void operator()(const char*, std::map<std::string, Value>& values) {
    values = Json::parse(next().getString()).get<std::map<std::string, Value>>();
  }
  template <int n>
  void operator()(const char*, Eigen::Matrix<double, n, n>& matrix) {
    read_matrix(next().getString(), matrix);
  }
};

std::string csv_field(const SQLite::Column& column) {
  if (column.isNull()) return {};
  if (column.isFloat()) return number_text(column.getDouble());
  std::string text = column.getString();
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

void check_file(const std::filesystem::path& path, bool must_exist) {
  if (std::filesystem::is_directory(path))
    throw std::runtime_error(path.string() + ": is a folder; expected a result file");
  if (std::filesystem::exists(path)) return;
  if (must_exist) throw std::runtime_error(path.string() + ": does not exist");
  const auto folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  if (!std::filesystem::is_directory(folder))
    throw std::runtime_error(fmt::format("{}: cannot be created: there is no folder '{}'",
                                         path.string(), folder.string()));
}

}  // namespace

struct ResultStore::Impl {
  std::filesystem::path path;
  SQLite::Database database;
  int version = schema_version;  // of the tables in the file

  // Whatever SQLite or a damaged row throws, with the name of the file.
  template <class Work>
  auto guarded(Work&& work) {
    return guarded_for(path, std::forward<Work>(work));
  }

  template <class Work>
  static auto guarded_for(const std::filesystem::path& path, Work&& work) {
    try {
      return work();
    } catch (const SQLite::Exception& error) {
      throw std::runtime_error(path.string() + ": " + reason(error));
    } catch (const Json::exception& error) {
      throw std::runtime_error(path.string() + ": a row holds unexpected text: " + error.what());
    } catch (const std::invalid_argument& error) {
      throw std::runtime_error(path.string() + ": a row holds unexpected text: " + error.what());
    }
  }

  static std::unique_ptr<Impl> open(const std::filesystem::path& path, int flags) {
    return guarded_for(path, [&] {
      return std::unique_ptr<Impl>(new Impl{path, {path.string(), flags, patience_ms}});
    });
  }

  int pragma(const char* name) {
    return database.execAndGet(std::string("PRAGMA ") + name).getInt();
  }

  void check_identity() {
    if (pragma("application_id") != application)
      throw std::runtime_error(path.string() + ": a SQLite file, but not a result table");
    version = pragma("user_version");
    if (version < 1 || version > schema_version)
      throw std::runtime_error(fmt::format(
          "{}: result table of version {}, expected version 1 to {}: it was written by another "
          "version of this program",
          path.string(), version, schema_version));
  }

  // Makes a file of version 1 one of today's; its rows stay. To be called within a transaction.
  void upgrade() {
    version = pragma("user_version");  // another process may have been faster since we looked
    if (version == schema_version) return;
    for (const std::string_view column : new_columns)
      database.exec(fmt::format("ALTER TABLE trials ADD COLUMN {} INTEGER", column));
    database.exec(fmt::format("PRAGMA user_version = {}", schema_version));
    version = schema_version;
  }

  // What a program killed before its first write leaves; anything else must be ours.
  bool empty() { return pragma("page_count") == 0; }
};

ResultStore::ResultStore(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ResultStore::~ResultStore() = default;
ResultStore::ResultStore(ResultStore&&) noexcept = default;
ResultStore& ResultStore::operator=(ResultStore&&) noexcept = default;

ResultStore ResultStore::create_or_resume(const std::filesystem::path& path) {
  check_file(path, false);
  std::unique_ptr<Impl> impl = Impl::open(path, SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  impl->guarded([&] {
    const bool fresh = impl->empty();
    if (!fresh) impl->check_identity();
    // Also shows whether we can write, before hours of work.
    SQLite::Transaction transaction(impl->database, SQLite::TransactionBehavior::IMMEDIATE);
    // Another process may have been faster since we looked.
    if (fresh && impl->pragma("application_id") == 0) {
      impl->database.exec(schema());
      impl->database.exec(fmt::format("PRAGMA application_id = {}", application));
      impl->database.exec(fmt::format("PRAGMA user_version = {}", schema_version));
    }
    impl->upgrade();
    transaction.commit();
  });
  return ResultStore(std::move(impl));
}

ResultStore ResultStore::open(const std::filesystem::path& path) {
  check_file(path, true);
  // Opened for writing where the file allows it, as SQLite must then be able to undo the unfinished
  // write of a killed program; we ourselves only ask.
  std::unique_ptr<Impl> impl = Impl::open(path, SQLite::OPEN_READWRITE);
  impl->guarded([&] {
    if (impl->empty())
      throw std::runtime_error(path.string() + ": is empty; expected a result table");
    impl->check_identity();
    impl->database.exec("PRAGMA query_only = 1");
  });
  return ResultStore(std::move(impl));
}

int ResultStore::begin_run(const RunInfo& run) {
  return impl_->guarded([&] {
    SQLite::Statement insert(impl_->database,
                             "INSERT INTO runs (version, command_line, machine, threads, started, "
                             "finished) VALUES (?, ?, ?, ?, ?, ?)");
    run_columns(run, Binder{insert});
    insert.exec();
    return static_cast<int>(impl_->database.getLastInsertRowid());
  });
}

void ResultStore::end_run(int run, const std::string& finished) {
  impl_->guarded([&] {
    SQLite::Statement update(impl_->database, "UPDATE runs SET finished = ? WHERE run = ?");
    update.bind(1, finished);
    update.bind(2, run);
    if (update.exec() != 1)
      throw std::runtime_error(fmt::format("{}: there is no run {}", impl_->path.string(), run));
  });
}

void ResultStore::write(const std::vector<Outcome>& outcomes, int run) {
  if (outcomes.empty()) return;
  impl_->guarded([&] {
    const std::string names = trial_columns();
    std::string marks = "?";
    for (const char c : names)
      if (c == ',') marks += ", ?";
    SQLite::Transaction transaction(impl_->database, SQLite::TransactionBehavior::IMMEDIATE);
    SQLite::Statement insert(
        impl_->database,
        fmt::format("INSERT OR REPLACE INTO trials ({}) VALUES ({})", names, marks));
    for (const Outcome& outcome : outcomes) {
      Binder bind{insert};
      bind("trial_id", trial_id(outcome.trial));
      columns(outcome, bind);
      bind("run", run);
      insert.exec();
      insert.reset();
    }
    transaction.commit();
  });
}

std::size_t ResultStore::relabel(const std::vector<Trial>& trials) {
  return impl_->guarded([&] {
    const std::string names = trial_columns();
    std::string values = names;
    values.replace(values.find("study"), 5, "?2");
    values.replace(values.find("axes"), 4, "?3");
    SQLite::Transaction transaction(impl_->database, SQLite::TransactionBehavior::IMMEDIATE);
    SQLite::Statement insert(
        impl_->database,
        fmt::format("INSERT OR REPLACE INTO trials ({}) SELECT {} FROM trials WHERE trial_id = ?1 "
                    "AND study <> ?2 AND message = '' ORDER BY study LIMIT 1",
                    names, values));
    std::size_t copied = 0;
    for (const Trial& trial : trials) {
      insert.bind(1, trial_id(trial));
      insert.bind(2, trial.study);
      insert.bind(3, Json(trial.axes).dump());
      copied += static_cast<std::size_t>(insert.exec());
      insert.reset();
    }
    transaction.commit();
    return copied;
  });
}

void ResultStore::merge(const std::filesystem::path& other) {
  ResultStore source = open(other);  // checks that it is one of ours
  const std::vector<RunInfo> added_runs = source.runs();
  impl_->guarded([&] {
    SQLite::Database& database = impl_->database;
    const int before = database.execAndGet("SELECT coalesce(max(run), 0) FROM runs").getInt();
    SQLite::Statement attach(database, "ATTACH ? AS other");
    attach.bind(1, other.string());
    attach.exec();
    // A failed statement must not leave the file attached.
    try {
      SQLite::Transaction transaction(database, SQLite::TransactionBehavior::IMMEDIATE);
      database.exec(fmt::format(
          "INSERT INTO runs SELECT run + {}, version, command_line, machine, threads, started, "
          "finished FROM other.runs",
          before));
      // The run is the last column.
      const std::string names = trial_columns();
      const std::string theirs = trial_columns(source.impl_->version);
      const std::string shifted = theirs.substr(0, theirs.rfind("run"));
      database.exec(fmt::format(
          "INSERT OR REPLACE INTO trials ({}) SELECT {} run + {} FROM other.trials AS theirs "
          "WHERE NOT EXISTS (SELECT 1 FROM main.trials AS ours WHERE ours.trial_id = "
          "theirs.trial_id AND ours.study = theirs.study AND (ours.message = '' OR theirs.message "
          "<> ''))",
          names, shifted, before));
      transaction.commit();
    } catch (...) {
      database.exec("DETACH other");
      throw;
    }
    database.exec("DETACH other");
  });
}

std::unordered_set<std::string> ResultStore::ids(bool failed, const std::string& study) const {
  return impl_->guarded([&] {
    SQLite::Statement query(impl_->database,
                            "SELECT trial_id FROM trials WHERE (?1 OR message = '') AND "
                            "(?2 = '' OR study = ?2)");
    query.bind(1, failed ? 1 : 0);
    query.bind(2, study);
    std::unordered_set<std::string> found;
    while (query.executeStep()) found.insert(query.getColumn(0).getString());
    return found;
  });
}

std::vector<Outcome> ResultStore::read(const std::string& study) const {
  return impl_->guarded([&] {
    SQLite::Statement query(impl_->database,
                            fmt::format("SELECT {} FROM trials WHERE ?1 = '' OR study = ?1 "
                                        "ORDER BY trial_id, study",
                                        trial_columns(impl_->version)));
    query.bind(1, study);
    std::vector<Outcome> outcomes;
    while (query.executeStep()) {
      Outcome& outcome = outcomes.emplace_back();
      columns(outcome, Reader{query, 1});  // the id follows from the rest
    }
    return outcomes;
  });
}

std::vector<RunInfo> ResultStore::runs() const {
  return impl_->guarded([&] {
    SQLite::Statement query(
        impl_->database,
        "SELECT version, command_line, machine, threads, started, finished FROM "
        "runs ORDER BY run");
    std::vector<RunInfo> list;
    while (query.executeStep()) {
      RunInfo& run = list.emplace_back();
      run_columns(run, Reader{query});
    }
    return list;
  });
}

std::string ResultStore::csv() const {
  return impl_->guarded([&] {
    SQLite::Statement query(impl_->database,
                            fmt::format("SELECT {} FROM trials ORDER BY trial_id, study",
                                        trial_columns(impl_->version)));
    std::string text;
    const auto add = [&](int column, const std::string& field) {
      text += field;
      text += column + 1 < query.getColumnCount() ? ',' : '\n';
    };
    for (int i = 0; i < query.getColumnCount(); ++i) add(i, query.getColumnName(i));
    while (query.executeStep())
      for (int i = 0; i < query.getColumnCount(); ++i) add(i, csv_field(query.getColumn(i)));
    return text;
  });
}

}  // namespace minescan
