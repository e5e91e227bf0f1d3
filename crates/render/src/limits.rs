//! What an adapter must be able to do, and what is asked of it.

/// What a device must be able to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Demand {
    /// Buffers and storage bindings as large as the adapter offers, and time stamps where it has
    /// them.
    Offered,
    /// WebGPU's default limits and no optional feature: what nearly every adapter has.
    Least,
}

/// Most groups of a row of a dispatch: WebGPU has 65,535.
pub(crate) const MOST_GROUPS: u32 = 32_768;

/// A limit of adapters: its name in WebGPU, where it is found, and what this program cannot do
/// without.
struct Need {
    name: &'static str,
    of: fn(&wgpu::Limits) -> u64,
    least: u64,
}

macro_rules! needs {
    ($($name:ident: $least:expr),* $(,)?) => {
        [$(Need {
            name: stringify!($name),
            of: |limits| u64::from(limits.$name),
            least: $least,
        }),*]
    };
}

/// Most are below WebGPU's defaults. What depends on the scene or the picture is checked where that
/// is known: buffers by [`DeviceBytes::check`](crate::passes::DeviceBytes::check), sides of
/// pictures by [`ProgressiveRenderer::set_size`](crate::ProgressiveRenderer::set_size).
const NEEDS: [Need; 22] = needs! {
    // Tables of painted fibres, and paint of two million points.
    max_texture_dimension_2d: 2048,
    // Tables of multiple scattering.
    max_texture_dimension_3d: 256,
    // One of ours, two of the window's.
    max_bind_groups: 2,
    max_bindings_per_bind_group: 29,
    max_dynamic_uniform_buffers_per_pipeline_layout: 1,
    max_sampled_textures_per_shader_stage: 7,
    max_samplers_per_shader_stage: 1,
    max_storage_buffers_per_shader_stage: 8,
    max_storage_textures_per_shader_stage: 1,
    max_uniform_buffers_per_shader_stage: 8,
    max_uniform_buffer_binding_size: 16 << 10,
    max_storage_buffer_binding_size: 16 << 20,
    max_buffer_size: 16 << 20,
    max_inter_stage_shader_variables: 8,
    max_color_attachments: 1,
    max_color_attachment_bytes_per_sample: 8,
    max_compute_workgroup_storage_size: 4096,
    max_compute_invocations_per_workgroup: 256,
    max_compute_workgroup_size_x: 256,
    max_compute_workgroup_size_y: 8,
    max_compute_workgroup_size_z: 1,
    // Rows of dispatches over more points than that.
    max_compute_workgroups_per_dimension: MOST_GROUPS as u64,
};

/// Uniforms with offsets are written at multiples of this.
const OFFSET_ALIGNMENT: u32 = 256;

/// The limits to ask an adapter for that offers `offered`: WebGPU's defaults where it has them,
/// else what it has; buffers as large as it has where they are in demand.
///
/// # Errors
/// The first limit without which nothing can be drawn: its name, what the adapter has and what is
/// needed.
pub(crate) fn to_ask_for(offered: &wgpu::Limits, demand: Demand) -> Result<wgpu::Limits, String> {
    for need in &NEEDS {
        let has = (need.of)(offered);
        if has < need.least {
            let (name, least) = (need.name, need.least);
            return Err(format!("its {name} is {has}; {least} is needed"));
        }
    }
    let alignment = offered.min_uniform_buffer_offset_alignment;
    if alignment > OFFSET_ALIGNMENT {
        return Err(format!(
            "its min_uniform_buffer_offset_alignment is {alignment}; {OFFSET_ALIGNMENT} or less is \
             needed"
        ));
    }
    let mut limits = wgpu::Limits::default().or_worse_values_from(offered);
    if demand == Demand::Offered {
        limits.max_storage_buffer_binding_size = offered.max_storage_buffer_binding_size;
        limits.max_buffer_size = offered.max_buffer_size;
    }
    Ok(limits)
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandlight_shaders::{MODULES, resolve_with};

    #[test]
    fn usual_adapters_are_asked_for_the_defaults() {
        let rich = wgpu::Limits {
            max_texture_dimension_2d: 32_768,
            max_storage_buffer_binding_size: 1 << 30,
            max_buffer_size: 1 << 32,
            min_uniform_buffer_offset_alignment: 64,
            ..wgpu::Limits::default()
        };
        let least = to_ask_for(&rich, Demand::Least).unwrap();
        assert_eq!(least, wgpu::Limits::default());
        let offered = to_ask_for(&rich, Demand::Offered).unwrap();
        assert_eq!(offered.max_texture_dimension_2d, 8192);
        assert_eq!(offered.max_storage_buffer_binding_size, 1 << 30);
        assert_eq!(offered.max_buffer_size, 1 << 32);
    }

    #[test]
    fn lesser_adapters_are_asked_for_what_they_have() {
        let small = wgpu::Limits {
            max_texture_dimension_2d: 4096,
            max_buffer_size: 64 << 20,
            max_storage_buffer_binding_size: 32 << 20,
            max_uniform_buffer_binding_size: 16 << 10,
            max_bind_groups: 2,
            ..wgpu::Limits::default()
        };
        for demand in [Demand::Offered, Demand::Least] {
            assert_eq!(to_ask_for(&small, demand).as_ref(), Ok(&small));
        }
    }

    #[test]
    fn the_first_limit_that_is_missed_is_named() {
        let refused = |limits: &wgpu::Limits| to_ask_for(limits, Demand::Offered).unwrap_err();
        let text = refused(&wgpu::Limits::downlevel_defaults());
        assert_eq!(
            text,
            "its max_storage_buffers_per_shader_stage is 4; 8 is needed"
        );
        let text = refused(&wgpu::Limits {
            min_uniform_buffer_offset_alignment: 512,
            ..wgpu::Limits::default()
        });
        assert!(text.contains("is 512; 256 or less"), "{text}");
        // What is just enough is enough, and one less is not.
        for (ix, need) in NEEDS.iter().enumerate() {
            assert!((need.of)(&wgpu::Limits::default()) >= need.least, "{ix}");
        }
        let sides = |max_texture_dimension_2d| wgpu::Limits {
            max_texture_dimension_2d,
            ..wgpu::Limits::default()
        };
        assert!(to_ask_for(&sides(2048), Demand::Least).is_ok());
        assert!(refused(&sides(2047)).contains("max_texture_dimension_2d is 2047; 2048"));
    }

    /// What the entry points of every pass bind and how large their groups are.
    #[test]
    fn no_shader_needs_more() {
        let least = |name: &str| {
            let need = NEEDS.iter().find(|need| need.name == name);
            need.map_or(0, |need| need.least)
        };
        let mut n_entry_points = 0;
        let passes = MODULES.iter().filter(|(name, _)| {
            name.starts_with("pass/") && !name.contains("probe") && !name.contains("bench")
        });
        let features: [&[&str]; 8] = [
            &[],
            &["TABLES"],
            &["TABLES", "ELLIPTIC_TABLES"],
            &["TABLES", "BOUNCE"],
            &["TABLES", "WIDE"],
            &["PROXIES"],
            &["MESHES"],
            &["PAINTED", "PAINTED_WIDTHS", "PAINTED_SHIFTS"],
        ];
        for (name, features) in passes.flat_map(|(name, _)| features.map(|one| (name, one))) {
            let text = resolve_with(name, features).unwrap();
            let module = naga::front::wgsl::parse_str(&text).unwrap();
            let capabilities = naga::valid::Capabilities::SHADER_FLOAT16_IN_FLOAT32;
            let flags = naga::valid::ValidationFlags::all();
            let mut validator = naga::valid::Validator::new(flags, capabilities);
            let info = validator.validate(&module).unwrap();
            for (ix, entry_point) in module.entry_points.iter().enumerate() {
                let used = info.get_entry_point(ix);
                let count = |is_kind: &dyn Fn(&naga::GlobalVariable) -> bool| {
                    let globals = module.global_variables.iter();
                    let bound = globals.filter(|(handle, one)| {
                        one.binding.is_some() && !used[*handle].is_empty() && is_kind(one)
                    });
                    bound.count() as u64
                };
                let image = |one: &naga::GlobalVariable| match module.types[one.ty].inner {
                    naga::TypeInner::Image { class, .. } => {
                        Some(matches!(class, naga::ImageClass::Storage { .. }))
                    }
                    _ => None,
                };
                let in_storage = |one: &naga::GlobalVariable| {
                    matches!(one.space, naga::AddressSpace::Storage { .. })
                };
                let [x, y, z] = entry_point.workgroup_size.map(u64::from);
                for (limit, needed) in [
                    ("max_storage_buffers_per_shader_stage", count(&in_storage)),
                    (
                        "max_uniform_buffers_per_shader_stage",
                        count(&|one| one.space == naga::AddressSpace::Uniform),
                    ),
                    (
                        "max_samplers_per_shader_stage",
                        count(&|one| {
                            let kind = &module.types[one.ty].inner;
                            matches!(kind, naga::TypeInner::Sampler { .. })
                        }),
                    ),
                    (
                        "max_sampled_textures_per_shader_stage",
                        count(&|one| image(one) == Some(false)),
                    ),
                    (
                        "max_storage_textures_per_shader_stage",
                        count(&|one| image(one) == Some(true)),
                    ),
                    (
                        "max_bindings_per_bind_group",
                        module
                            .global_variables
                            .iter()
                            .filter(|(handle, _)| !used[*handle].is_empty())
                            .filter_map(|(_, one)| one.binding.as_ref())
                            .map(|binding| u64::from(binding.binding) + 1)
                            .max()
                            .unwrap_or(0),
                    ),
                    ("max_compute_invocations_per_workgroup", x * y * z),
                    ("max_compute_workgroup_size_x", x),
                    ("max_compute_workgroup_size_y", y),
                    ("max_compute_workgroup_size_z", z),
                ] {
                    let entry = &entry_point.name;
                    assert!(needed <= least(limit), "{name} {entry}: {limit} {needed}");
                }
                n_entry_points += 1;
            }
        }
        assert!(n_entry_points > 40, "{n_entry_points}");
    }
}
