//! Small parts of meshes that several formats share.

use glam::Vec3;
use pellucid_core::{Error, Mesh};

/// Adds a file's normals; those that are zero or not finite are replaced by smooth ones, as a normal must point
/// somewhere.
pub(crate) fn repair_normals(mesh: Mesh, mut normals: Vec<Vec3>) -> Result<Mesh, Error> {
    let usable = |normal: &Vec3| normal.is_finite() && *normal != Vec3::ZERO;
    if normals.iter().all(usable) {
        return mesh.with_normals(normals);
    }
    let smooth = mesh.clone().with_smooth_normals();
    for (normal, &better) in normals.iter_mut().zip(smooth.normals().unwrap_or_default()) {
        if !usable(normal) {
            *normal = better;
        }
    }
    mesh.with_normals(normals)
}
