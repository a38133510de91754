// Time series of a run: one row a step, as HDF5 or CSV.
#pragma once

#include <fstream>
#include <string>
#include <vector>

#include "files/hdf5.hpp"

namespace nscdd {

// One quantity of one step. Shape: {} of a number, {dim} of a vector, {dim, dim} of a tensor. Labels: one of each value
// in C order, such as "x" or "xy", none of a number.
struct SeriesValue {
    std::string name, unit, meaning;
    hdf5::Shape shape;
    std::vector<std::string> labels;
    std::vector<double> values;
};
using SeriesRow = std::vector<SeriesValue>;  // every row of a series has the same quantities

// Data that do not change with the steps: root attributes of the HDF5 file.
struct SeriesHead {
    std::string scene;
    int dim = 0;
    double h = 0;                 // [s]
    double energy_tolerance = 0;  // on the column energy_error
    std::vector<double> box;      // (dim) edges before the first step [m]; NaN where there are no two walls
};

// "name" of a number, else "name_LABEL": the columns of one quantity in CSV, in C order.
std::vector<std::string> column_names(const SeriesValue& value);

// One file, by its ending .csv or .h5, .hdf5. Throws InputError for another ending.
class SeriesWriter {
  public:
    static void check_name(const std::string& path);
    // Throws OutputError, as add() and save() do.
    SeriesWriter(FileSet& files, const std::string& path, const SeriesHead& head);

    // CSV goes to the file beside its place at once, HDF5 is kept in memory, some 600 bytes a row, until save().
    void add(const SeriesRow& row);
    void save();

  private:
    void write_line(const std::string& line);

    std::string path_;
    SeriesHead head_;
    FileSet* files_;
    bool csv_;
    std::ofstream text_;
    SeriesRow columns_;  // values of all rows so far, one behind the other
    std::size_t rows_ = 0;
};

}  // namespace nscdd
