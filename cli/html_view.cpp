#include "html_view.hpp"

#include "cloud_file/cloud_file_error.hpp"
#include "cloud_file/whole_file.hpp"
#include "command.hpp"

namespace vnreg::cli {

void write_html_view(const std::string& path, const viewer::ViewedPair& pair) {
  const std::string page = viewer::view_page(viewer::view_data(pair));
  try {
    cloud_file::write_whole_file(path, {page});
  } catch (const cloud_file::CloudFileError& error) {
    throw CommandError(ExitCode::failure, error.what());
  }
}

}  // namespace vnreg::cli
