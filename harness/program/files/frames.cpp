#include "files/frames.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "files/state.hpp"
#include "files/xdmf.hpp"

namespace nscdd {
namespace {

std::string group(const FrameHead& head) { return fmt::format("step_{:010}", head.step); }

std::string grid(const FrameHead& head, std::string_view name, std::string_view inside) {
    return fmt::format("      <Grid Name=\"{}\" GridType=\"Uniform\">\n        <Time Value=\"{}\"/>\n{}      </Grid>\n",
                       name, head.time, inside);
}

std::string collection(std::string_view name, std::string_view grids) {
    return fmt::format("    <Grid Name=\"{}\" GridType=\"Collection\" CollectionType=\"Temporal\">\n{}    </Grid>\n",
                       name, grids);
}

}  // namespace

FrameWriter::FrameWriter(FileSet& files, const std::string& path, const std::string& scene)
    : files_(files), path_(path), file_(std::in_place, files, path) {
    file_->attribute("scene", scene);
    file_->save();
}

void FrameWriter::begin(const FrameHead& head) {
    file_.emplace(files_, path_);
    frame_ = head;
    points_ = ends_ = 0;
    const std::string at = group(head);
    const hsize_t n = head.grains, c = head.contacts;
    file_->attribute("step", head.step, at);
    file_->attribute("time", head.time, at);
    for (const char* name : {"x", "velocity", "spin"}) file_->declare<double>(at + "/grains/" + name, {n, 3});
    file_->declare<double>(at + "/grains/radius", {n});
    for (const char* name : {"id", "subdomain", "multiplicity"}) file_->declare<int>(at + "/grains/" + name, {n});
    file_->declare<double>(at + "/contacts/ends", {2 * c, 3});
    file_->declare<int>(at + "/contacts/lines", {c, 2});
    file_->declare<int>(at + "/contacts/grains", {c, 2});
    file_->declare<double>(at + "/contacts/force", {c, 3});
    for (const char* name : {"normal_force", "gap"}) file_->declare<double>(at + "/contacts/" + name, {c});
    file_->declare<int>(at + "/contacts/subdomain", {c});
}

void FrameWriter::append(const FrameRows& rows) {
    const std::string grains = group(frame_) + "/grains/", contacts = group(frame_) + "/contacts/";
    std::vector<int> ids(rows.radius.size());
    for (int& id : ids) id = points_++;
    file_->append(grains + "id", ids);
    file_->append(grains + "x", rows.x);
    file_->append(grains + "radius", rows.radius);
    file_->append(grains + "velocity", rows.velocity);
    file_->append(grains + "spin", rows.spin);
    file_->append(grains + "subdomain", rows.subdomain);
    file_->append(grains + "multiplicity", rows.multiplicity);
    std::vector<int> lines(rows.contacts.grains.size());  // the ends of each contact follow each other
    for (int& end : lines) end = ends_++;
    file_->append(contacts + "lines", lines);
    file_->append(contacts + "ends", rows.contacts.ends);
    file_->append(contacts + "grains", rows.contacts.grains);
    file_->append(contacts + "force", rows.contacts.force);
    file_->append(contacts + "normal_force", rows.contacts.normal_force);
    file_->append(contacts + "gap", rows.contacts.gap);
    file_->append(contacts + "subdomain", rows.contacts.subdomain);
}

std::string FrameWriter::grid_of_grains(const FrameHead& head) const {
    const std::string h5 = std::filesystem::path(path_).filename().string(), at = group(head) + "/grains/";
    const auto item = [&](const char* name, const char* type, int columns) {
        return xdmf::item(h5, at + name, type, head.grains, columns);
    };
    std::string inside = fmt::format(
        "        <Topology TopologyType=\"Polyvertex\" NumberOfElements=\"{}\" NodesPerElement=\"1\">{}"
        "</Topology>\n        <Geometry GeometryType=\"XYZ\">{}</Geometry>\n",
        head.grains, item("id", "Int", 1), item("x", "Float", 3));
    for (const char* name : {"velocity", "spin"})
        inside += xdmf::attribute(name, "Vector", "Node", item(name, "Float", 3));
    inside += xdmf::attribute("radius", "Scalar", "Node", item("radius", "Float", 1));
    for (const char* name : {"id", "subdomain", "multiplicity"})
        inside += xdmf::attribute(name, "Scalar", "Node", item(name, "Int", 1));
    return grid(head, "grains", inside);
}

std::string FrameWriter::grid_of_contacts(const FrameHead& head) const {
    const std::string h5 = std::filesystem::path(path_).filename().string(), at = group(head) + "/contacts/";
    const auto item = [&](const char* name, const char* type, int columns) {
        return xdmf::item(h5, at + name, type, head.contacts, columns);
    };
    std::string inside = fmt::format(
        "        <Topology TopologyType=\"Polyline\" NumberOfElements=\"{}\" NodesPerElement=\"2\">{}"
        "</Topology>\n        <Geometry GeometryType=\"XYZ\">{}</Geometry>\n",
        head.contacts, item("lines", "Int", 2), xdmf::item(h5, at + "ends", "Float", 2 * head.contacts, 3));
    inside += xdmf::attribute("force", "Vector", "Cell", item("force", "Float", 3));
    for (const char* name : {"normal_force", "gap"})
        inside += xdmf::attribute(name, "Scalar", "Cell", item(name, "Float", 1));
    inside += xdmf::attribute("subdomain", "Scalar", "Cell", item("subdomain", "Int", 1));
    return grid(head, "contacts", inside);
}

void FrameWriter::end() {
    file_->save();
    files_.place(path_, &file_->written());
    grains_ += grid_of_grains(frame_);
    if (frame_.contacts > 0) contacts_ += grid_of_contacts(frame_);
    ++frames_;
    // it is written whole: with every frame, many would take ever longer
    if (frames_ < 100 || frames_ >= listed_ + listed_ / 100) {
        add_xdmf();
        files_.place(xdmf_beside(path_));
    }
}

void FrameWriter::add_xdmf() {
    std::string grids = collection("grains", grains_);
    if (!contacts_.empty()) grids += collection("contacts", contacts_);
    files_.add(xdmf_beside(path_), xdmf::document(grids));
    listed_ = frames_;
}

void FrameWriter::save() { add_xdmf(); }

}  // namespace nscdd
