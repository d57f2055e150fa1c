//! What is asked of the motor, and how it is done.

use super::{ChartState, Commander, Drivecom, Settings, Standstill, Stop, time::Brake};
use crate::Ramp;

/// What is asked of the motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    /// Leave it as it is.
    Nothing,
    /// Run at the reference.
    Run,
    /// Block the output.
    Lock,
    /// Inject direct current for as long as it is asked for.
    Inject,
    /// Stop so.
    Stop(Stop),
}

impl Order {
    /// The order of a control word in operation enabled; of several stops the fastest.
    const fn of(word: u16, settings: &Settings) -> Self {
        let bits = settings.bits;
        if word & bits.fast_stop != 0 {
            Self::Stop(Stop::Fast)
        } else if word & bits.injection != 0 {
            Self::Inject
        } else if word & bits.stop != 0 {
            Self::Stop(settings.stop)
        } else {
            Self::Run
        }
    }
}

impl Drivecom {
    /// Carries out what is ordered now. A stop acts once, when it is ordered: one that is over does not begin again
    /// because the same word is written again.
    pub(super) fn obey(&mut self) {
        let order = self.ordered();
        let is_new = order != self.order;
        self.order = order;
        if is_new {
            self.timers.forget();
        }
        match order {
            Order::Nothing => {}
            Order::Run => {
                self.stopped_by_key = false;
                self.motor.run(self.target(), self.settings.ramps);
            }
            Order::Lock => self.motor.freewheel(),
            Order::Inject if is_new => {
                self.timers.begin_injection();
                self.motor.brake(self.settings.injection_current, None);
            }
            Order::Inject | Order::Stop(_) if !is_new => {}
            Order::Stop(Stop::Ramp) => self.ramp_down(self.settings.ramps.deceleration),
            Order::Stop(Stop::Fast) => self.ramp_down(self.settings.fast_stop),
            Order::Stop(Stop::Freewheel) => self.motor.freewheel(),
            Order::Inject | Order::Stop(Stop::DcInjection) => {
                self.motor.brake(self.settings.injection_current, Some(self.settings.injection_time));
            }
        }
        self.settle();
    }

    pub(super) fn ramp_down(&mut self, ramp: Ramp) {
        if self.motor.is_braking() {
            self.motor.freewheel();
        }
        self.timers.ramped = self.motor.is_fed();
        self.motor.ramp_to_rest(ramp);
    }

    fn ordered(&self) -> Order {
        match self.state {
            ChartState::Fault | ChartState::FaultReactionActive => Order::Nothing,
            ChartState::SwitchOnDisabled | ChartState::ReadyToSwitchOn => Order::Lock,
            ChartState::SwitchedOn if self.readings.disabling_coasts => Order::Lock,
            ChartState::SwitchedOn => Order::Stop(self.settings.stop),
            ChartState::QuickStopActive => Order::Stop(Stop::Fast),
            ChartState::OperationEnabled => self.ordered_in_operation(),
        }
    }

    /// Stops have priority over run commands (BBV51701 p. 8, 14).
    fn ordered_in_operation(&self) -> Order {
        let (commanded, stops) = (self.commanded(), self.situation.stops);
        match commanded {
            Order::Stop(Stop::Fast) => commanded,
            _ if stops.fast => Order::Stop(Stop::Fast),
            _ if stops.injection => Order::Inject,
            Order::Run if self.spent || self.timers.is_asleep || self.is_braked() => {
                Order::Stop(self.settings.stop)
            }
            _ => commanded,
        }
    }

    /// Whether a brake has to be released yet.
    fn is_braked(&self) -> bool {
        !self.settings.brake_release.is_zero() && self.timers.brake != Brake::Released
    }

    fn commanded(&self) -> Order {
        match (self.situation.commander, self.word) {
            (Commander::Bus, Some(word)) if self.obeys => Order::of(word, &self.settings),
            (Commander::Bus, _) => Order::Stop(self.settings.stop),
            _ if self.situation.run.is_some() => Order::Run,
            _ => Order::Stop(self.settings.stop),
        }
    }

    pub(super) fn is_told_to_run(&self) -> bool {
        self.state == ChartState::OperationEnabled && self.commanded() == Order::Run
    }

    /// Injects at standstill by itself where the settings ask for it (BBV51701 p. 41): at the end of a ramp, or as
    /// long as the motor stands in operation enabled.
    pub(super) fn hold_at_standstill(&mut self) {
        let (mode, currents) = self.settings.standstill;
        let stands = self.state == ChartState::OperationEnabled && matches!(self.order, Order::Stop(_));
        if self.timers.held > 0 && (mode == Standstill::No || !stands) {
            self.timers.held = 0;
            if stands {
                self.motor.freewheel();
            }
        }
        let begins = match mode {
            Standstill::No => false,
            Standstill::Timed => self.timers.ramped || self.timers.held > 0,
            Standstill::Continuous => true,
        };
        if !stands || !begins || self.motor.is_fed() || self.motor.shaft_frequency() != 0 {
            return;
        }
        self.timers.ramped = false;
        let next = currents.into_iter().enumerate().skip(self.timers.held);
        let continues = |place: usize| mode == Standstill::Continuous && place + 1 == currents.len();
        for (place, current) in next {
            if !current.time.is_zero() || continues(place) {
                self.timers.held = place + 1;
                self.motor.brake(current.percent, (!continues(place)).then_some(current.time));
                return;
            }
        }
        self.timers.held = 0;
    }
}
