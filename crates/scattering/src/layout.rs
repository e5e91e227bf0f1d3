//! Layouts of the structs that Rust writes and shaders read, so that a test can compare both sides.
//!
//! A file with such structs registers them once, beside their definitions, with
//! [`mirrors!`](crate::mirrors). [`closed_form::layouts`](crate::closed_form::layouts) lists those of
//! this crate; crates that have structs of their own list theirs the same way.

/// A struct whose memory a struct of a shader mirrors.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    /// Name in Rust.
    pub name: &'static str,
    /// Name in WGSL.
    pub wgsl: &'static str,
    /// Shader module that defines it, such as `lib/grid`.
    pub module: &'static str,
    /// Size in bytes.
    pub size: usize,
    /// Fields in order.
    pub fields: &'static [Field],
}

/// A field of a [`Layout`].
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// Name in Rust.
    pub name: &'static str,
    /// Distance from the start of the struct in bytes.
    pub offset: usize,
    /// Size in bytes.
    pub size: usize,
    type_name: fn() -> &'static str,
}

impl Field {
    /// The field that `get` answers. `get` is never called; it gives the field's type.
    pub const fn new<S, F>(name: &'static str, offset: usize, get: fn(&S) -> &F) -> Field {
        let _ = get;
        Field {
            name,
            offset,
            size: size_of::<F>(),
            type_name: core::any::type_name::<F>,
        }
    }

    /// The type that the field is made of, without arrays and paths: `f32` for `[[f32; 4]; 3]`.
    pub fn element(&self) -> &'static str {
        let name = (self.type_name)();
        let name = name.rsplit('[').next().unwrap_or(name);
        let name = name.split(';').next().unwrap_or(name);
        name.rsplit("::").next().unwrap_or(name)
    }

    /// Whether the field only fills the struct: its name starts with `pad`. Shaders may split or
    /// join such fields.
    pub fn is_padding(&self) -> bool {
        self.name.starts_with("pad")
    }
}

/// Registers the structs of a file that shaders mirror, each with all its fields in order: defines
/// the [`Layout`](crate::layout::Layout)s as a constant `LAYOUTS`. A field that is left out does
/// not compile.
///
/// ```
/// #[repr(C)]
/// struct Grade {
///     scale: f32,
///     tone_map: u32,
/// }
/// strandlight_scattering::mirrors! {
///     Grade as "Grade" in "pass/display" { scale, tone_map }
/// }
/// ```
#[doc(hidden)]
#[macro_export]
macro_rules! mirrors {
    ($($name:ident as $wgsl:literal in $module:literal { $($field:ident),+ $(,)? })+) => {
        pub(crate) const LAYOUTS: &[$crate::layout::Layout] = &[$({
            const _: fn(&$name) = |whole| {
                let $name { $($field: _),+ } = whole;
            };
            $crate::layout::Layout {
                name: stringify!($name),
                wgsl: $wgsl,
                module: $module,
                size: size_of::<$name>(),
                fields: &[$(
                    $crate::layout::Field::new(
                        stringify!($field),
                        core::mem::offset_of!($name, $field),
                        |whole: &$name| &whole.$field,
                    )
                ),+],
            }
        }),+];
    };
}
