//! `[hair]`, in the order of the panel.

use strandlight_scattering::closed_form::{DENSITY_BACK, DENSITY_FORWARD};
use strandlight_scattering::color::{sigma_a_from_melanin, sigma_a_from_reflectance};
use strandlight_scattering::{HairParams, Parameter};

use super::section::Conversion::{Degrees, Same, StdDevDegrees};
use super::section::{Param, Place, Section, at};
use super::spec::{Absent, Group, Kind, Shape, Word};
use crate::scene_hair::HairSection;

/// The fibres' optics.
pub const HAIR: Section<HairSection> = Section {
    name: "hair",
    heading: "[hair]",
    kind: None,
    help: "The fibres' optics. Without it, brown hair.",
    params: PARAMS,
    plain: HairSection::default,
};

/// Range of the concentration of a pigment.
const PIGMENT: [f64; 2] = [0.0, 20.0];
/// What a slider of one covers.
const PIGMENT_SLIDER: [f64; 2] = [0.0, 8.0];

/// The modes with what each is to the eye.
const MODES: &[Word] = &[
    ("R", "R", "Reflected at the surface: the white highlight."),
    (
        "TT",
        "TT",
        "Transmitted through the fibre: the glow of backlight.",
    ),
    (
        "TRT",
        "TRT",
        "Reflected once inside the fibre: the second, coloured highlight and its glints.",
    ),
];

/// The models with what each is for.
const MODELS: &[Word] = &[
    (
        "marschner",
        "Marschner",
        "R, TT and TRT as published: what the papers compare with. Loses energy in light hair.",
    ),
    (
        "energy",
        "Energy",
        "All orders, and lobes that lose nothing at grazing angles: white hair stays white. Round, \
             unpainted hair alone.",
    ),
];

const PARAMS: &[Param<HairSection>] = &[
    Param::new(
        "model",
        "Model",
        Kind::Choice(MODELS),
        at!(HairSection.model),
    )
    .help("The fibre model."),
    Param::new("preset", "Preset", Kind::Preset, at!(HairSection.preset))
        .group(Group::Color)
        .absent(Absent::Words("none"))
        .help("Measured or published hair. A preset replaces colour, index, shifts and widths."),
    Param::numbers(
        "sigma_a",
        "Absorption",
        Shape::Rgb,
        Parameter::SigmaA.range(),
        at!(HairSection.sigma_a),
    )
    .group(Group::Color)
    .symbol("sigma_a")
    .unit("per fibre radius")
    .slider(0.0, 6.0)
    .decimals(3)
    .help(
        "Absorption coefficient of the fibre for red, green and blue, per fibre radius. More of a \
             channel makes the hair darker in it. This is what the physics uses.",
    ),
    Param::numbers(
        "reflectance",
        "Reflectance",
        Shape::Rgb,
        [0.0, 1.0],
        at!(HairSection.reflectance),
    )
    .group(Group::Color)
    .absent(Absent::Words("unset (`sigma_a` is used)"))
    .decimals(4)
    .help("Colour of a full head of hair; the absorption is computed from it."),
    Param::number("melanin.eumelanin", "Eumelanin", PIGMENT, EUMELANIN)
        .group(Group::Color)
        .absent(Absent::Words("unset (`sigma_a` is used)"))
        .slider(PIGMENT_SLIDER[0], PIGMENT_SLIDER[1])
        .help("Brown to black pigment: 0.3 blond, 1.3 brown, 8 black."),
    Param::number("melanin.pheomelanin", "Pheomelanin", PIGMENT, PHEOMELANIN)
        .group(Group::Color)
        .absent(Absent::Words("unset (`sigma_a` is used)"))
        .slider(PIGMENT_SLIDER[0], PIGMENT_SLIDER[1])
        .help("Yellow to red pigment: 1 to 2 gives red hair."),
    Param::number(
        "eta",
        "IOR",
        Parameter::Eta.range(),
        at!(HairSection.eta),
    )
    .model(Parameter::Eta, Same)
    .symbol("eta")
    .slider(1.2, 2.0)
    .decimals(3)
    .help(
        "Index of refraction. Higher makes the white highlight stronger and moves the coloured \
             one. Human hair has 1.55.",
    ),
    Param::number(
        "caustic_width_deg",
        "Glint width",
        [0.5, 60.0],
        at!(HairSection.caustic_width_deg),
    )
    .model(Parameter::CausticWidth, StdDevDegrees)
    .symbol("w_c / sqrt 2")
    .unit("°")
    .slider(0.5, 30.0)
    .help(
        "Blur around the fibre of light that was reflected inside it. Small values give glints, \
             large ones an even coloured sheen.",
    ),
    Param::number(
        "eccentricity",
        "Eccentricity",
        Parameter::Eccentricity.range(),
        at!(HairSection.eccentricity),
    )
    .model(Parameter::Eccentricity, Same)
    .symbol("a")
    .help("Cross section: 1 is round, otherwise elliptic, which brightens or dims the glints."),
    Param::number(
        "diameter_cm",
        "Diameter",
        [1e-5, 10.0],
        at!(HairSection.diameter_cm),
    )
    .absent(Absent::Words("the groom's `diameter`, or else 0.008"))
    .unit("cm")
    .decimals(5)
    .help("Diameter of a fibre. Human hair has 50 to 100 micrometres."),
    Param::number("taper", "Taper", [0.0, 0.99], at!(HairSection.taper))
        .help(
            "How much thinner strands are at the tip than at the root, as a share of the diameter there. Hair \
             with a diameter per point keeps its own.",
        ),
    Param::number(
        "density_forward",
        "Density forward",
        [0.0, 1.0],
        at!(HairSection.density_forward),
    )
    .absent(Absent::Number(DENSITY_FORWARD as f64))
    .symbol("d_f")
    .help(
        "d_f: share of the light blocked by hair in front that is scattered on. Lower is darker \
             inside the hair.",
    ),
    Param::number(
        "density_back",
        "Density back",
        [0.0, 1.0],
        at!(HairSection.density_back),
    )
    .absent(Absent::Number(DENSITY_BACK as f64))
    .symbol("d_b")
    .help(
        "d_b: share of the hair behind a fibre that sends light back to it. Lower is darker and \
             less saturated.",
    ),
    Param::new(
        "modes",
        "Modes",
        Kind::Choices(MODES),
        at!(HairSection.modes),
    )
    .group(Group::Lobes)
    .help(
        "Enabled scattering modes, the light paths through a fibre. The switches affect only the strand's own \
         scattering: light arriving through other hair always includes all modes. Ground truth and --converge apply them at every bounce.",
    ),
    Param::numbers(
        "shift_deg",
        "Tilt",
        Shape::PerLobe,
        [-28.0, 28.0],
        at!(HairSection.shift_deg),
    )
    .model(Parameter::Shift, Degrees)
    .group(Group::Lobes)
    .symbol("alpha")
    .unit("°")
    .slider(-20.0, 20.0)
    .help(
        "Cuticle tilt: how far the tilted scales of the fibre move the highlight of a mode along the strand, \
             towards root or tip. Human hair: R -5 to -10 degrees, TT half and TRT one and a half \
             times that the other way.",
    ),
    Param::numbers(
        "width_deg",
        "Roughness",
        Shape::PerLobe,
        [0.05, 60.0],
        at!(HairSection.width_deg),
    )
    .model(Parameter::Width, StdDevDegrees)
    .group(Group::Lobes)
    .symbol("beta / sqrt 2")
    .unit("°")
    .slider(0.5, 40.0)
    .help(
        "Roughness along the strand: standard deviation of a mode's highlight. Small is glossy, \
             large is matt.",
    ),
    Param::number("intensity_r", "Intensity R", Parameter::Intensity.range(), at!(HairSection.intensity_r))
        .model_at(Parameter::Intensity, 0, Same)
        .group(Group::Lobes)
        .help("Factor on R, the white highlight: 1 is physical, less takes light away."),
    Param::number("intensity_tt", "Intensity TT", Parameter::Intensity.range(), at!(HairSection.intensity_tt))
        .model_at(Parameter::Intensity, 1, Same)
        .group(Group::Lobes)
        .help("Factor on TT, the glow of light from behind: 1 is physical, less takes light away."),
    Param::number("intensity_trt", "Intensity TRT", Parameter::Intensity.range(), at!(HairSection.intensity_trt))
        .model_at(Parameter::Intensity, 2, Same)
        .group(Group::Lobes)
        .help("Factor on TRT, the coloured highlight and its glints: 1 is physical, less takes light away."),
];

const EUMELANIN: Place<HairSection> = Place {
    get: |hair| Some(&hair.melanin.as_ref()?.eumelanin),
    get_mut: |hair| Some(&mut hair.melanin.get_or_insert_default().eumelanin),
};

const PHEOMELANIN: Place<HairSection> = Place {
    get: |hair| Some(&hair.melanin.as_ref()?.pheomelanin),
    get_mut: |hair| Some(&mut hair.melanin.get_or_insert_default().pheomelanin),
};

impl HairSection {
    /// The model's parameters: degrees and standard deviations as radians and Xu's widths, the
    /// colour as an absorption.
    pub fn params(&self) -> HairParams {
        let mut model = HairParams::default();
        for param in HAIR.params {
            param.put_in_model(self, &mut model);
        }
        model.model = self.model;
        model.sigma_a = match (self.reflectance, self.melanin) {
            (Some(rgb), _) => sigma_a_from_reflectance(rgb, model.caustic_width),
            (None, Some(melanin)) => sigma_a_from_melanin(melanin.eumelanin, melanin.pheomelanin),
            (None, None) => self.sigma_a,
        };
        model
    }
}
